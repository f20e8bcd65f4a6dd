// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracker_state.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace stillmap {

/// Match of a keypoint with a keypoint of the previous frame.
struct FrameMatch {
  std::uint32_t previous = 0;  ///< keypoint of the previous frame
  PointMatch match;            ///< its point, matched with the newest frame
};

struct PreviousFramePose {
  PoseEstimate estimate;
  std::vector<FrameMatch> matches;  ///< all matches, including moving points and outliers
};

/// Tracks the camera from the previous frame: predicts its pose by constant velocity, searches the
/// points of the previous frame near their predicted pixels and solves for the pose. Landmarks
/// alone are used if enough of them agree. Returns none if too few points are found.
/// @param weights of the keypoints of `features`; those of weight 0 are not matched; empty: all are
/// @param with_points whether points that are no landmarks are used where landmarks are too few
std::optional<PreviousFramePose> track_previous_frame(const TrackingModel& model,
                                                      const TrackerState& state,
                                                      const Features& features,
                                                      const std::vector<float>& weights = {},
                                                      bool with_points = true);

}  // namespace stillmap
