// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/relocalization_tracking.hpp"

#include "stillmap/track/previous_frame_tracking.hpp"
#include "stillmap/track/reference_keyframe_tracking.hpp"

#include <memory>
#include <utility>

namespace stillmap {
namespace {

/// Returns the recognized frame as the tracker would have left it.
TrackedFramePtr tracked_at(const RelocalizationResult& found) {
  auto result = std::make_shared<TrackedFrame>();
  result->frame = found.frame;
  result->state = TrackState::kTracking;
  result->reference = found.local_map->reference;
  result->T_reference_camera = found.T_reference_camera;
  result->landmarks = found.landmarks;
  result->inliers = found.inliers;
  return result;
}

TrackerState state_at(const RelocalizationResult& found) {
  TrackerState state;
  state.local_map = found.local_map;
  state.previous = tracked_at(found);
  state.T_world_previous = pose_in(*state.local_map, *state.previous).value();
  return state;
}

}  // namespace

std::optional<RelocalizedPose> track_from_relocalization(const TrackingModel& model,
                                                         const RelocalizationResult& found,
                                                         const Frame& frame, int min_landmarks) {
  TrackerState state = state_at(found);
  std::optional<PoseEstimate> first;
  if (auto tracked = track_previous_frame(model, state, *frame.features)) {
    first = std::move(tracked->estimate);
  } else {
    first = track_reference_keyframe(model, *state.local_map, state.T_world_previous, frame);
  }
  if (!first) return std::nullopt;
  auto pose = refine_in_local_map(model, *state.local_map, frame, *first, min_landmarks);
  if (!pose || std::ssize(pose->estimate.matches) < kSureInliers) return std::nullopt;
  return RelocalizedPose{std::move(state), std::move(*pose)};
}

}  // namespace stillmap
