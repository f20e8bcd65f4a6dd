// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/map_bundle.hpp"

#include <map>

namespace stillmap {
namespace {

BundleObservation bundle_observation(const Map& map, const Keyframe& keyframe,
                                     const Observation& o) {
  const Keypoint& k = keyframe.features->keypoints[o.keypoint];
  return {.u = k.u,
          .v = k.v,
          .depth = k.depth,
          .scale = static_cast<float>(map.pyramid().scale(k.level)),
          .weight = keyframe.static_weight[o.keypoint]};
}

}  // namespace

MapBundle make_bundle(const Map& map, const std::vector<KeyframeId>& keyframes, std::size_t free,
                      const std::vector<LandmarkId>& landmarks) {
  MapBundle bundle{keyframes, free, landmarks, {}, {}};
  BundleProblem& problem = bundle.problem;
  problem.camera = map.camera();
  std::map<KeyframeId, std::uint32_t> pose_of;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    pose_of[keyframes[i]] = static_cast<std::uint32_t>(i);
    problem.T_world_camera.push_back(map.at(keyframes[i]).T_world_camera);
    problem.pose_fixed.push_back(i >= free);
  }
  for (std::uint32_t p = 0; p < landmarks.size(); ++p) {
    const Landmark& landmark = map.at(landmarks[p]);
    problem.points.push_back(landmark.p_world);
    for (const Observation& o : landmark.observations) {
      const auto pose = pose_of.find(o.keyframe);
      if (pose == pose_of.end()) continue;
      BundleObservation observation = bundle_observation(map, map.at(o.keyframe), o);
      observation.pose = pose->second;
      observation.point = p;
      problem.observations.push_back(observation);
      bundle.observations.emplace_back(landmark.id, o.keyframe);
    }
  }
  return bundle;
}

void apply(Map& map, const MapBundle& bundle, const BundleResult& result) {
  for (std::size_t i = 0; i < bundle.free; ++i) {
    if (map.find(bundle.keyframes[i]) != nullptr)
      map.set_pose(bundle.keyframes[i], result.T_world_camera[i]);
  }
  for (std::size_t p = 0; p < bundle.landmarks.size(); ++p) {
    if (map.find(bundle.landmarks[p]) != nullptr)
      map.set_position(bundle.landmarks[p], result.points[p]);
  }
  for (std::size_t i = 0; i < bundle.observations.size(); ++i) {
    const auto& [landmark, keyframe] = bundle.observations[i];
    if (result.pixel_outlier[i]) map.forget(landmark, keyframe);
  }
  for (const LandmarkId id : bundle.landmarks) {
    if (map.find(id) != nullptr) map.refresh(id);
  }
}

}  // namespace stillmap
