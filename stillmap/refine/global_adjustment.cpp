// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/global_adjustment.hpp"

#include <algorithm>
#include <map>

namespace stillmap {
namespace {

using Poses = std::map<KeyframeId, Pose>;

/// Returns the optimized poses of the keyframes that the map still contains.
Poses poses_of(const Map& map, const MapBundle& bundle, const BundleResult& result) {
  Poses poses;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (map.find(bundle.keyframes[i]) != nullptr)
      poses[bundle.keyframes[i]] = result.T_world_camera[i];
  }
  return poses;
}

/// Returns the moved keyframe that `id` shares most landmarks with, or any if it shares none.
KeyframeId parent_of(const Map& map, KeyframeId id, const Poses& moved) {
  for (const Covisible& c : map.covisible(id)) {
    if (moved.contains(c.keyframe)) return c.keyframe;
  }
  return moved.begin()->first;
}

void let_the_others_follow(const Map& map, std::uint32_t component, Poses& poses) {
  for (const KeyframeId id : keyframes_of(map, component)) {
    if (poses.contains(id)) continue;
    const KeyframeId parent = parent_of(map, id, poses);
    poses[id] = poses[parent] * map.at(parent).T_world_camera.inverse() * map.at(id).T_world_camera;
  }
}

}  // namespace

MapBundle whole_component(const Map& map, std::uint32_t component) {
  std::vector<KeyframeId> keyframes = keyframes_of(map, component);
  std::vector<LandmarkId> landmarks = landmarks_seen_by(map, keyframes);
  std::erase_if(landmarks, [&](LandmarkId id) { return map.at(id).observations.size() < 2; });
  const std::size_t free = keyframes.empty() ? 0 : keyframes.size() - 1;
  if (free > 0) std::rotate(keyframes.begin(), keyframes.begin() + 1, keyframes.end());
  return make_bundle(map, keyframes, free, landmarks);
}

void apply_to_grown_map(Map& map, const MapBundle& bundle, const BundleResult& result) {
  Poses poses = poses_of(map, bundle, result);
  if (poses.empty()) return;
  let_the_others_follow(map, map.at(poses.begin()->first).component, poses);
  move_keyframes(map, poses);
  apply(map, bundle, result);
}

BundleResult adjust_globally(Map& map, std::uint32_t component) {
  const MapBundle bundle = whole_component(map, component);
  if (bundle.free == 0) return {};
  BundleResult result = adjust_bundle(bundle.problem);
  apply_to_grown_map(map, bundle, result);
  return result;
}

}  // namespace stillmap
