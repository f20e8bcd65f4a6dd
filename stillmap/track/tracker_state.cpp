// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/tracker_state.hpp"

namespace stillmap {

std::optional<Pose> pose_in(const LocalMap& local_map, const TrackedFrame& tracked) {
  const KeyframeId reference =
      tracked.state == TrackState::kStarted ? local_map.reference : tracked.reference;
  const LocalKeyframe* keyframe = local_map.find(reference);
  if (keyframe == nullptr) return std::nullopt;
  return keyframe->T_world_camera * tracked.T_reference_camera;
}

}  // namespace stillmap
