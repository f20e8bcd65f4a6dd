// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/occupancy.hpp"

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stillmap {

/// Two-dimensional occupancy grid for a robot on the floor.
struct OccupancyGrid {
  double resolution = 0;                             ///< Side of a cell [m].
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< Lower left corner in frame `map` [m].
  cv::Mat1b image;  ///< 0 occupied, 254 free, 205 unknown; the upper row has the highest y.
};

/// Projects the space between `lowest` and `highest` above the floor onto the floor. A cell is
/// occupied if any of its voxels in the band is. Otherwise it is free if one of them is free or the
/// floor below was observed.
OccupancyGrid floor_plan(const OccupiedSpace& space, const OccupancyOptions& options = {});

}  // namespace stillmap
