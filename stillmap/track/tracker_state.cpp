// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/tracker_state.hpp"

namespace stillmap {

std::optional<Pose> pose_in(const LocalMap& local_map, const TrackedFrame& tracked) {
  // The keyframe of a frame that starts a map or a part of it is the center of its snapshot.
  if (tracked.starts_part()) return local_map.keyframes.front().T_world_camera;
  const LocalKeyframe* keyframe = local_map.find(tracked.reference);
  if (keyframe == nullptr) return std::nullopt;
  return keyframe->T_world_camera * tracked.T_reference_camera;
}

}  // namespace stillmap
