// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/cell_grid.hpp"

#include <cstddef>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace stillmap {

/// Instance index of a cell that no instance covers.
inline constexpr int kNoInstance = -1;
/// Minimum share of an object's cells that must move for the object to count as moving [0..1];
/// chosen on simulated scenes.
inline constexpr double kMinMovingShare = 0.3;
/// Minimum number of cells with depth of a mover; chosen on simulated scenes.
inline constexpr int kMinMoverCells = 12;

/// Returns the largest depth difference of neighboring cells of one object, by depth [m].
DepthPolynomial<double> object_depth_step(const Camera& camera);

/// The cells of a frame that may belong to movers.
struct MoverGrid {
  const CellGrid& cells;
  cv::Mat1b moves;     ///< 255 where a cell moves, else 0.
  cv::Mat1f depth;     ///< Depth of a cell that may belong to a mover [m]; 0 for all other cells.
  cv::Mat1i instance;  ///< Index of the instance that covers a cell, or kNoInstance.
  cv::Mat1b in_mask;   ///< 255 where the mask of this instance includes the cell's center, else 0.
  DepthPolynomial<double> depth_step = object_depth_step(cells.camera);

  const Camera& camera() const { return cells.camera; }
};

/// The cells of one object.
struct MoverRegion {
  std::vector<cv::Point> cells;
  std::vector<Eigen::Vector3d> points;  ///< One per cell, camera frame [m].
  Eigen::AlignedBox3d box;              ///< Around the connected pieces, camera frame [m].
};

/// The instance that covers most of a region.
struct InstanceCover {
  int instance = kNoInstance;
  double share = 0;  ///< Share of the region's cells that it covers [0..1].
};
InstanceCover cover_of(const MoverRegion& region, const MoverGrid& grid);

/// Returns the share of a region's cells that move [0..1].
double moving_share(const MoverRegion& region, const MoverGrid& grid);

/// Returns a region per object, ordered by the first cell. Regions that no instance covers and
/// that hardly move are left out.
std::vector<MoverRegion> mover_regions(const MoverGrid& grid);

/// Returns the number of moving regions of the image with depth in less than a tenth of the cells.
int count_without_depth(const MoverGrid& grid);

/// Returns the box of points without the outermost 2 % on each side of each axis, as these may be
/// flying pixels [m].
/// @param points at least one
Eigen::AlignedBox3d box_without_flying_pixels(const std::vector<Eigen::Vector3d>& points);

/// Returns how many of some points are left out on each side of an axis as flying pixels.
std::size_t flying_pixels(std::size_t points);

/// Returns the cells whose eight neighbors are all set; neighbors outside the image count as set.
cv::Mat1b without_rim(const cv::Mat1b& cells);

}  // namespace stillmap
