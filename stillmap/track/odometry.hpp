// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/frame.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <optional>

namespace stillmap {

/// Tracks the camera by visual odometry: solves for the pose from the points of the previous frame,
/// landmarks or not, weighted by the frame's motion evidence. Returns none if too few agree.
/// @param initial the frame's pose from the previous frame (see track_previous_frame())
std::optional<PoseEstimate> track_by_odometry(const TrackingModel& model, const Frame& frame,
                                              const PoseEstimate& initial);

}  // namespace stillmap
