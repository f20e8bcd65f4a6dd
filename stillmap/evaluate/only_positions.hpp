// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

namespace stillmap {

/// Returns whether one of two trajectories of a camera has positions only, as those of a total
/// station: it moves, and either its rotations never change and those of the other change by 5
/// degrees or more, or all are exactly the identity, as read_trajectory() sets them without
/// rotations in the file, and those of the other are not.
bool has_only_positions(const Trajectory& truth, const Trajectory& estimate);

}  // namespace stillmap
