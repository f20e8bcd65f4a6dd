// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/motion/cell_grid.hpp"

#include <deque>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A frame's cells with their pose.
struct CellView {
  double timestamp = 0;  ///< [s]
  Pose T_camera_world;
  CellGridPtr cells;
  cv::Mat1b moves;  ///< 255 where a cell moves, else 0.
};

/// Views of the last seconds, in which points of a new frame are looked up.
class RecentViews {
 public:
  /// Adds a view if the last one is old enough, and forgets the oldest of too many.
  void add(CellView view);
  /// Moves the views along with a corrected world.
  void move(const Pose& T_corrected_world);
  /// Forgets all views.
  void clear() { views_.clear(); }

  /// Returns whether more views had a static surface at a point than a moving or no surface.
  bool was_static(const Eigen::Vector3d& p_world) const;
  /// Returns whether views saw through the points more often than they had a surface there.
  /// @param points camera frame [m]
  bool was_free(const std::vector<Eigen::Vector3d>& points, const Pose& T_world_camera) const;

 private:
  std::deque<CellView> views_;  // oldest first
};

}  // namespace stillmap
