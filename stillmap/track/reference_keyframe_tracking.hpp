// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <optional>

namespace stillmap {

/// Tracks the camera from the local map's reference keyframe: matches descriptors without a
/// prediction of their pixels and solves for the pose. Returns none if too few landmarks agree.
/// @param T_world_camera_guess start of the optimization, such as the previous frame's pose
std::optional<PoseEstimate> track_reference_keyframe(const TrackingModel& model,
                                                     const LocalMap& local_map,
                                                     const Pose& T_world_camera_guess,
                                                     const Frame& frame);

}  // namespace stillmap
