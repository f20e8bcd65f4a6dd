// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// The maps for planners.
struct OccupancyOptions {
  double cell = 0.05;     ///< Side of the voxels and of the grid's cells [m].
  double lowest = 0.10;   ///< Lower end of the 2-D grid's height band, above the floor [m].
  double highest = 1.80;  ///< Upper end of the height band [m].
};

}  // namespace stillmap
