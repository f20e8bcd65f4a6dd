// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/motion/cell_grid.hpp"

namespace stillmap {

struct SpreadOptions {
  double reach = 0.20;  ///< along a surface, over which evidence falls to 1 / e [m]
  /// How many meters along a surface one meter of depth jump counts for.
  double jump_cost = 10;
  STILLMAP_FIELDS(reach, jump_cost)
};

/// Sums each cell's value with those of the cells around it, weighted by exp(-d / reach), where d
/// is the way to them along the surface, so that evidence spreads over things and not over depth
/// edges: the recursive filter in the transformed domain of Gastal and Oliveira (SIGGRAPH 2011,
/// section 4), once along the rows and once along the columns, unnormalized. Deterministic.
class SurfaceSpread {
 public:
  SurfaceSpread(const CellGrid& grid, const SpreadOptions& options);
  cv::Mat1f operator()(const cv::Mat1f& values) const;

 private:
  cv::Mat1f from_left_, from_above_;  // what is passed on by the neighbor, 0 to 1
};

}  // namespace stillmap
