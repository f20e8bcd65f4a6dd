// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// What planners get.
struct OccupancyOptions {
  double cell = 0.05;     ///< side of voxels and of the grid's cells [m]
  double lowest = 0.10;   ///< height band of the 2-D grid, above the floor [m]
  double highest = 1.80;  ///< [m]
};

}  // namespace stillmap
