// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh_simplification.hpp"

#include "stillmap/base/trace.hpp"

#include <meshoptimizer.h>

namespace stillmap {

TriangleMesh simplified(const TriangleMesh& mesh, double error) {
  const TraceScope scope("mesh simplification");
  if (mesh.empty()) return mesh;
  const float* positions = mesh.vertices.front().data();
  const std::size_t stride = sizeof(mesh.vertices.front());
  const std::size_t vertices = mesh.vertices.size(), indices = 3 * mesh.triangles.size();
  const float scale = meshopt_simplifyScale(positions, vertices, stride);
  TriangleMesh fewer{mesh.vertices, mesh.colors, mesh.triangles};
  const std::size_t left = meshopt_simplify(
      fewer.triangles.front().data(), mesh.triangles.front().data(), indices, positions, vertices,
      stride, 0, static_cast<float>(error) / scale, 0, nullptr);
  fewer.triangles.resize(left / 3);
  return without_specks(fewer, 1);
}

}  // namespace stillmap
