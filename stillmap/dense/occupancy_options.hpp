// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"

namespace stillmap {

/// What planners get.
struct OccupancyOptions {
  double cell = 0.05;          ///< side of voxels and of the grid's cells [m]
  int min_points = 3;          ///< points of the cloud that make a voxel occupied
  double lowest = 0.10;        ///< height band of the 2-D grid, above the floor [m]
  double highest = 1.80;       ///< [m]
  double min_obstacle = 0.15;  ///< obstacles smaller than this in all directions are left out [m]
  STILLMAP_FIELDS(cell, min_points, lowest, highest, min_obstacle)
};

/// Throws Error if an option is out of range.
void require_valid(const OccupancyOptions& options);

}  // namespace stillmap
