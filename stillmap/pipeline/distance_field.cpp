// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/grid_checks.hpp"
#include "stillmap/slam.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace stillmap {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

/// A position between the centers of eight cells.
struct Between {
  Eigen::Vector3i low;   // the first of the cells
  Eigen::Vector3d part;  // from its center [cells]
};

/// Returns the position in the field; none outside.
std::optional<Between> between(const DistanceField& field, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d at = (p_world - field.origin) / field.cell - Eigen::Vector3d::Constant(0.5);
  if (!(at.array().abs() < 1e9).all()) return std::nullopt;
  const Eigen::Vector3i low = at.array().floor().cast<int>();
  if ((low.array() < 0).any() || (low.array() + 1 >= field.size.array()).any()) return std::nullopt;
  return Between{low, at - low.cast<double>()};
}

std::size_t place_of(const DistanceField& field, const Eigen::Vector3i& cell) {
  const auto x = static_cast<std::size_t>(cell.x()), y = static_cast<std::size_t>(cell.y());
  const auto width = static_cast<std::size_t>(field.size.y()),
             depth = static_cast<std::size_t>(field.size.z());
  return (x * width + y) * depth + static_cast<std::size_t>(cell.z());
}

/// Lower envelope of parabolas: replaces the squared distances f of a row of cells by the minimum
/// over all cells j of f[j] + (i - j)^2 [cells^2].
class Envelope {
 public:
  explicit Envelope(int longest)
      : row_(static_cast<std::size_t>(longest)),
        vertices_(static_cast<std::size_t>(longest)),
        begins_(static_cast<std::size_t>(longest)) {}

  void replace(float* cells, std::size_t step, int count) {
    int parabolas = 0;
    for (int i = 0; i < count; ++i) {
      row_[i] = cells[static_cast<std::size_t>(i) * step];
      if (row_[i] == kNone) continue;
      while (parabolas > 0 && crossing(vertices_[parabolas - 1], i) <= begins_[parabolas - 1])
        --parabolas;
      begins_[parabolas] = parabolas == 0 ? -kNone : crossing(vertices_[parabolas - 1], i);
      vertices_[parabolas++] = i;
    }
    for (int i = 0, k = 0; i < count && parabolas > 0; ++i) {
      while (k + 1 < parabolas && begins_[k + 1] < static_cast<float>(i)) ++k;
      const auto away = static_cast<float>(i - vertices_[k]);
      cells[static_cast<std::size_t>(i) * step] = row_[vertices_[k]] + away * away;
    }
  }

 private:
  /// Returns where the parabola of `j` becomes lower than that of `i` < `j`.
  float crossing(int i, int j) const {
    const auto a = static_cast<float>(i), b = static_cast<float>(j);
    return (row_[j] + b * b - row_[i] - a * a) / (2 * (b - a));
  }

  std::vector<float> row_;
  std::vector<int> vertices_;
  std::vector<float> begins_;
};

/// Replaces zeros and infinities by the distances from the nearest zero [cells].
void transform(DistanceField& field) {
  const std::array<std::size_t, 3> steps{place_of(field, {1, 0, 0}), place_of(field, {0, 1, 0}), 1};
  Envelope envelope(field.size.maxCoeff());
  for (int axis = 2; axis >= 0; --axis) {
    Eigen::Vector3i others = field.size;
    others[axis] = 1;
    for (int x = 0; x < others.x(); ++x) {
      for (int y = 0; y < others.y(); ++y) {
        for (int z = 0; z < others.z(); ++z)
          envelope.replace(&field.distances[place_of(field, {x, y, z})],
                           steps[static_cast<std::size_t>(axis)], field.size[axis]);
      }
    }
  }
  for (float& distance : field.distances) distance = std::sqrt(distance);
}

}  // namespace

std::optional<DistanceField> distance_field(const Cloud& cloud, double cell, double margin) {
  constexpr const char* kWhere = "distance_field";
  require_positive(cell, "the side of a cell", kWhere);
  require_not_negative(margin, "the margin", kWhere);
  if (cloud.empty()) return std::nullopt;
  require_finite(cloud.points, kWhere);
  Eigen::AlignedBox3d extent;
  for (const Eigen::Vector3f& p : cloud.points) extent.extend(p.cast<double>());
  const Eigen::Array3d first = ((extent.min().array() - margin) / cell).floor();
  const Eigen::Array3d size = ((extent.max().array() + margin) / cell).floor() - first + 1;
  require_few_cells(Eigen::Vector3d(size * cell), cell, kWhere);
  DistanceField field{cell, first * cell, size.cast<int>(), {}};
  field.distances.assign(static_cast<std::size_t>(size.prod()), kNone);
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Array3d at = (p.cast<double>().array() / cell).floor() - first;
    field.distances[place_of(field, at.cast<int>().matrix())] = 0;
  }
  transform(field);
  for (float& distance : field.distances) distance *= static_cast<float>(cell);
  return field;
}

std::optional<double> DistanceField::distance_at(const Eigen::Vector3d& p_world) const {
  const auto at = between(*this, p_world);
  if (!at) return std::nullopt;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i offset(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const Eigen::Array3d share = (offset == 1).select(at->part.array(), 1 - at->part.array());
    sum += share.prod() * distances[place_of(*this, at->low + offset.matrix())];
  }
  return sum;
}

std::optional<Eigen::Vector3d> DistanceField::gradient_at(const Eigen::Vector3d& p_world) const {
  Eigen::Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d half = 0.5 * cell * Eigen::Vector3d::Unit(axis);
    const auto before = distance_at(p_world - half), behind = distance_at(p_world + half);
    if (!before || !behind) return std::nullopt;
    gradient[axis] = (*behind - *before) / cell;
  }
  return gradient;
}

}  // namespace stillmap
