// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/occupancy.hpp"

#include <string>

namespace stillmap {

/// Returns the space as an OctoMap file (.bt): Hornung, Wurm, Bennewitz, Stachniss, Burgard,
/// OctoMap, Autonomous Robots 2013, written by liboctomap. Equal neighbors are pruned.
/// Throws Error if the space reaches further than 2^15 voxels from the origin along an axis.
std::string octomap_bytes(const OccupiedSpace& space);

}  // namespace stillmap
