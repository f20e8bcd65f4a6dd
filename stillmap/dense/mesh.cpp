// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh.hpp"

#include "stillmap/base/disjoint_sets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stillmap {

TriangleMesh without_specks(const TriangleMesh& mesh, std::size_t min_triangles) {
  DisjointSets parts(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    parts.unite(a, b);
    parts.unite(b, c);
  }
  std::vector<std::size_t> size(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles) ++size[parts.root(triangle[0])];

  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);
  TriangleMesh kept;
  for (auto triangle : mesh.triangles) {
    if (size[parts.root(triangle[0])] < min_triangles) continue;
    for (std::uint32_t& vertex : triangle) {
      if (number[vertex] == kUnused) {
        number[vertex] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[vertex]);
        kept.colors.push_back(mesh.colors[vertex]);
      }
      vertex = number[vertex];
    }
    kept.triangles.push_back(triangle);
  }
  return kept;
}

Cloud sampled(const TriangleMesh& mesh, double spacing) {
  Cloud cloud;
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::array<Eigen::Vector3f, 3> p{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
    const std::array<Rgb, 3> color{mesh.colors[a], mesh.colors[b], mesh.colors[c]};
    const float longest =
        std::max({(p[1] - p[0]).norm(), (p[2] - p[0]).norm(), (p[2] - p[1]).norm()});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest / spacing)), 1, 64);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const float s = static_cast<float>(i) / static_cast<float>(steps);
        const float t = static_cast<float>(j) / static_cast<float>(steps);
        Rgb mixed;
        for (std::size_t k = 0; k < 3; ++k) {
          const float value = (1 - s - t) * static_cast<float>(color[0][k]) +
                              s * static_cast<float>(color[1][k]) +
                              t * static_cast<float>(color[2][k]);
          mixed[k] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
        }
        cloud.add((1 - s - t) * p[0] + s * p[1] + t * p[2], mixed);
      }
    }
  }
  return cloud;
}

}  // namespace stillmap
