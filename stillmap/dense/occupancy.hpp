// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/occupancy_options.hpp"
#include "stillmap/dense/voxel_index.hpp"
#include "stillmap/geometry/pose.hpp"

#include <vector>

namespace stillmap {

/// Space in voxels: occupied, free, or unknown.
struct OccupiedSpace {
  double edge = 0;              ///< Side of a voxel [m].
  std::vector<Voxel> occupied;  ///< Sorted; frame `map`.
  std::vector<Voxel> free;      ///< Sorted, none of them occupied; frame `map`.
};

/// Returns the space that the views measured. Voxels with enough points of the cloud are occupied.
/// Voxels that a view's ray crossed before it met a surface, static or moving, are free.
OccupiedSpace occupied_space(const PlacedMap& placed, const Pose& T_map_world,
                             const OccupancyOptions& options = {});

}  // namespace stillmap
