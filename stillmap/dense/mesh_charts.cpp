// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh_charts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

namespace stillmap {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
/// Least cosine of the angle between the normals of a triangle and of its chart.
constexpr float kMinCosine = 0.5F;
/// Triangles within a square of this side in the plane may differ by kMaxStep along its normal [m].
constexpr float kSquare = 0.1F, kMaxStep = 0.25F;

using Neighbors = std::array<std::uint32_t, 3>;

/// Returns the triangles at the three edges of each one; kNone at a border.
std::vector<Neighbors> neighbors_of(const TriangleMesh& mesh) {
  using Edge = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, int>;
  std::vector<Edge> edges;  // both vertices, triangle, place of the edge in it
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] =
          std::minmax(t[static_cast<std::size_t>(k)], t[static_cast<std::size_t>((k + 1) % 3)]);
      edges.emplace_back(low, high, i, k);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<Neighbors> neighbors(mesh.triangles.size(), {kNone, kNone, kNone});
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const auto& [low, high, triangle, place] = edges[i];
    const auto& [other_low, other_high, other, other_place] = edges[i - 1];
    if (low != other_low || high != other_high) continue;
    neighbors[triangle][static_cast<std::size_t>(place)] = other;
    neighbors[other][static_cast<std::size_t>(other_place)] = triangle;
  }
  return neighbors;
}

/// Returns two orthonormal axes of the plane with a normal.
Eigen::Matrix<float, 2, 3> plane_axes(const Eigen::Vector3f& normal) {
  Eigen::Matrix<float, 2, 3> axes;
  axes.row(0) = normal.unitOrthogonal();
  axes.row(1) = normal.cross(axes.row(0).transpose());
  return axes;
}

using Corners = std::array<Eigen::Vector3f, 3>;

/// The heights of the triangles of a chart above its plane.
class Layer {
 public:
  /// @param reach  largest distance of a triangle from the origin along each axis [m]
  Layer(const Eigen::Vector3f& normal, const Eigen::Matrix<float, 2, 3>& axes,
        const Eigen::Vector3f& origin, float reach)
      : normal_(normal), axes_(axes), origin_(origin), reach_(reach) {}

  /// Adds a triangle, unless it is out of reach, or there is another one above or below it.
  bool add(const Corners& triangle) {
    std::vector<std::pair<std::pair<int, int>, float>> heights;
    const Eigen::Vector3f center = (triangle[0] + triangle[1] + triangle[2]) / 3;
    for (const Eigen::Vector3f& point : {triangle[0], triangle[1], triangle[2], center}) {
      const Eigen::Vector3f to = point - origin_;
      const Eigen::Vector2f p = axes_ * to;
      if (p.cwiseAbs().maxCoeff() > reach_) return false;
      const std::pair square(static_cast<int>(std::floor(p.x() / kSquare)),
                             static_cast<int>(std::floor(p.y() / kSquare)));
      heights.emplace_back(square, normal_.dot(to));
      const auto former = heights_.find(square);
      if (former != heights_.end() && std::abs(former->second - heights.back().second) > kMaxStep)
        return false;
    }
    heights_.insert(heights.begin(), heights.end());
    return true;
  }

 private:
  Eigen::Vector3f normal_;
  Eigen::Matrix<float, 2, 3> axes_;
  Eigen::Vector3f origin_;
  float reach_;
  std::map<std::pair<int, int>, float> heights_;  // of the first triangle in a square [m]
};

class Charts {
 public:
  Charts(const TriangleMesh& mesh, double side)
      : mesh_(mesh),
        reach_(static_cast<float>(side / 2)),
        neighbors_(neighbors_of(mesh)),
        is_taken_(mesh.triangles.size(), false) {
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3f cross =
          (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
      areas_.push_back(cross.norm());
      normals_.emplace_back(cross.normalized());
      if (!normals_.back().allFinite()) normals_.back() = Eigen::Vector3f::Zero();
    }
  }

  /// Returns the charts that grow from the largest triangles that are left.
  std::vector<MeshChart> grown() {
    std::vector<std::uint32_t> by_area(mesh_.triangles.size());
    std::iota(by_area.begin(), by_area.end(), 0U);
    std::stable_sort(by_area.begin(), by_area.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return areas_[a] > areas_[b]; });
    std::vector<MeshChart> charts;
    for (const std::uint32_t seed : by_area) {
      if (!is_taken_[seed]) charts.push_back(grown_from(seed));
    }
    return charts;
  }

 private:
  MeshChart grown_from(std::uint32_t seed) {
    const Eigen::Vector3f normal =
        normals_[seed].isZero() ? Eigen::Vector3f(0, 0, 1) : normals_[seed];
    MeshChart chart{{seed}, plane_axes(normal)};
    Layer layer(normal, chart.axes, center_of(seed), reach_);
    layer.add(corners_of(seed));
    is_taken_[seed] = true;
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      for (const std::uint32_t next : neighbors_[chart.triangles[i]]) {
        if (next == kNone || is_taken_[next]) continue;
        if (normals_[next].dot(normal) < kMinCosine && !normals_[next].isZero()) continue;
        if (!layer.add(corners_of(next))) continue;
        is_taken_[next] = true;
        chart.triangles.push_back(next);
      }
    }
    std::sort(chart.triangles.begin(), chart.triangles.end());
    return chart;
  }

  Corners corners_of(std::uint32_t triangle) const {
    const auto& [a, b, c] = mesh_.triangles[triangle];
    return {mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]};
  }
  Eigen::Vector3f center_of(std::uint32_t triangle) const {
    const auto& [a, b, c] = corners_of(triangle);
    return (a + b + c) / 3;
  }

  const TriangleMesh& mesh_;
  float reach_;
  std::vector<Neighbors> neighbors_;
  std::vector<bool> is_taken_;
  std::vector<float> areas_;  // twice the areas [m^2]
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace

std::vector<MeshChart> charts_of(const TriangleMesh& mesh, double side) {
  return Charts(mesh, side).grown();
}

}  // namespace stillmap
