// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/odometry.hpp"

namespace stillmap {

std::optional<PoseEstimate> track_by_odometry(const TrackingModel& model, const Frame& frame,
                                              const PoseEstimate& initial) {
  std::vector<PointMatch> matches;
  for (PointMatch match : initial.matches) {
    match.weight = frame.evidence.weight[match.keypoint];
    if (match.weight > 0) matches.push_back(match);
  }
  return estimate_pose(model, *frame.features, initial.T_world_camera, matches, kSureInliers);
}

}  // namespace stillmap
