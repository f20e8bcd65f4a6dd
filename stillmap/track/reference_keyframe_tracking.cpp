// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/reference_keyframe_tracking.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"

namespace stillmap {
namespace {

std::vector<PointMatch> match_reference(const LocalMap& local_map, const Frame& frame) {
  const TraceScope scope("match");
  const LocalKeyframe& reference = local_map.keyframes.front();
  BruteForceMatchOptions matching;
  matching.max_distance = kMaxMatchDistance;
  matching.ratio = kMatchRatio;
  const auto pairs =
      match_brute_force(reference.features->descriptors, frame.features->descriptors, matching);
  std::vector<PointMatch> matches;
  for (const auto& pair : pairs) {
    const LandmarkId id = reference.landmarks[pair.a];
    const LocalLandmark* landmark = id.valid() ? local_map.find(id) : nullptr;
    if (landmark == nullptr) continue;
    matches.push_back({pair.b, id, landmark->p_world, frame.evidence.weight[pair.b]});
  }
  return matches;
}

}  // namespace

std::optional<PoseEstimate> track_reference_keyframe(const TrackingModel& model,
                                                     const LocalMap& local_map,
                                                     const Pose& T_world_camera_guess,
                                                     const Frame& frame) {
  return estimate_pose(model, *frame.features, T_world_camera_guess,
                       match_reference(local_map, frame), kMinInliers);
}

}  // namespace stillmap
