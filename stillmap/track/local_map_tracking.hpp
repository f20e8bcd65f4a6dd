// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <optional>
#include <vector>

namespace stillmap {

/// Search radius around the projection of a landmark, level 0 [pixels]. ORB-SLAM2 uses 2.5 to 4.
inline constexpr double kLandmarkSearchRadius = 4;
/// Smallest cosine between a landmark's mean viewing direction and the present one: 60 degrees, as
/// in ORB-SLAM2.
inline constexpr double kMinViewCosine = 0.5;

struct LocalMapPose {
  PoseEstimate estimate;       ///< its matches are landmarks
  std::vector<char> expected;  ///< per landmark of the local map: 1 if it should be in the image
};

/// Refines a pose with the landmarks of the local map that should be in the image, weighted by the
/// frame's motion evidence. If too few of them agree, as in a blurred frame, points of the previous
/// frame may support the pose. They never suffice alone, because all may be on one moving object.
/// Returns none if too few landmarks agree.
/// @param first         approximate pose, and matches with landmarks and points of the previous
/// frame
/// @param min_landmarks least number of inliers among the landmarks
/// @param supported_by_points whether points of the previous frame may support the pose
/// @param prior         of the pose, as for estimate_pose()
std::optional<LocalMapPose> refine_in_local_map(
    const TrackingModel& model, const LocalMap& local_map, const Frame& frame,
    const PoseEstimate& first, int min_landmarks, bool supported_by_points = true,
    const std::optional<PosePrior>& prior = std::nullopt);

}  // namespace stillmap
