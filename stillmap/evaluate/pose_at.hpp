// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <optional>

namespace stillmap {

/// Returns T_world_camera at a time [s], interpolated between poses at most 0.1 s apart; none if
/// there are no such poses.
std::optional<Pose> pose_at(const Trajectory& trajectory, double timestamp);

}  // namespace stillmap
