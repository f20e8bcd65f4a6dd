// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/statistics.hpp"

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stillmap {

/// Returns the axis-aligned box around points without the outermost ones of each axis, or an empty
/// box of no points.
/// @param outermost number of points left out at either end of an axis, less than half of them
inline Eigen::AlignedBox3d trimmed_box(std::span<const Eigen::Vector3d> points,
                                       std::size_t outermost) {
  Eigen::AlignedBox3d box;
  if (points.empty()) return box;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    box.min()[axis] = value_of_rank(values, outermost);
    box.max()[axis] = value_of_rank(values, values.size() - 1 - outermost);
  }
  return box;
}

}  // namespace stillmap
