// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/cell_grid.hpp"

namespace stillmap {

/// Sums each cell's value with those of the cells around it, weighted by exp(-d / kReach) of their
/// distance d along the surface, so that evidence spreads over objects and not over
/// depth edges: the recursive filter in the transformed domain of Gastal and Oliveira (SIGGRAPH
/// 2011, section 4), once along the rows and once along the columns, unnormalized. Deterministic.
class SurfaceSpread {
 public:
  /// Distance along a surface over which evidence falls to 1 / e [m].
  static constexpr double kReach = 0.20;

  explicit SurfaceSpread(const CellGrid& grid);
  cv::Mat1f operator()(const cv::Mat1f& values) const;

 private:
  cv::Mat1f from_left_, from_above_;  // share that the neighbor passes on [0..1]
};

}  // namespace stillmap
