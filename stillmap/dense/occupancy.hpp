// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/occupancy_options.hpp"
#include "stillmap/dense/voxel_index.hpp"
#include "stillmap/geometry/pose.hpp"

#include <vector>

namespace stillmap {

/// Space in voxels: occupied, free, or, where neither, unknown.
struct OccupiedSpace {
  double edge = 0;              ///< side of a voxel [m]
  std::vector<Voxel> occupied;  ///< sorted; frame `map`
  std::vector<Voxel> free;      ///< sorted, none of them occupied
};

/// Returns the space that the views measured. Voxels with enough points of the cloud are occupied.
/// Voxels that a view's ray crossed before it met a surface, static or moving, are free.
OccupiedSpace occupied_space(const PlacedMap& placed, const Pose& T_map_world,
                             const OccupancyOptions& options = {});

}  // namespace stillmap
