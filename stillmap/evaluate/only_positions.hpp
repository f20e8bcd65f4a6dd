// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

namespace stillmap {

/// Returns whether one of two trajectories of a camera has positions only, as those of a total
/// station: its rotations never change while it moves, and those of the other change by 5 degrees
/// or more.
bool has_only_positions(const Trajectory& truth, const Trajectory& estimate);

}  // namespace stillmap
