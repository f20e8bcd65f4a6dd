// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/local_adjustment.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// The part of the map that one adjustment is about; indices into it are the solver's.
struct Window {
  std::vector<KeyframeId> keyframes;  ///< free ones first
  std::size_t free = 0;
  std::vector<LandmarkId> landmarks;  ///< sorted
};

/// Keyframes outside `inside` that see the landmarks, those that see most first.
std::vector<KeyframeId> onlookers(const Map& map, const std::vector<LandmarkId>& landmarks,
                                  const std::vector<KeyframeId>& inside, int most) {
  std::map<KeyframeId, int> seen;
  for (const LandmarkId id : landmarks) {
    for (const Observation& o : map.at(id).observations) ++seen[o.keyframe];
  }
  for (const KeyframeId id : inside) seen.erase(id);
  std::vector<std::pair<int, KeyframeId>> by_count;
  for (const auto& [id, count] : seen) by_count.emplace_back(-count, id);
  std::sort(by_count.begin(), by_count.end());
  std::vector<KeyframeId> result;
  for (const auto& [count, id] : by_count) {
    if (result.size() < static_cast<std::size_t>(most)) result.push_back(id);
  }
  return result;
}

/// The world frame is held by the component's first keyframe, or by the onlookers; a window without
/// either is held by its oldest keyframe.
void move_anchor_out_of_free(const Map& map, Window& window) {
  const auto begin = window.keyframes.begin();
  const auto end_free = begin + static_cast<std::ptrdiff_t>(window.free);
  const auto oldest = std::min_element(begin, end_free, [&](KeyframeId a, KeyframeId b) {
    return map.at(a).sequence < map.at(b).sequence;
  });
  const bool held = window.keyframes.size() > window.free;
  if (held && !map.is_first(*oldest)) return;
  std::rotate(oldest, oldest + 1, end_free);
  --window.free;
}

Window local_window(const Map& map, KeyframeId newest, const LocalAdjustmentOptions& options) {
  Window window;
  window.keyframes = {newest};
  for (const Covisible& c : map.covisible(newest, options.min_shared)) {
    if (window.keyframes.size() < static_cast<std::size_t>(options.max_free)) {
      window.keyframes.push_back(c.keyframe);
    }
  }
  window.free = window.keyframes.size();
  window.landmarks = landmarks_seen_by(map, window.keyframes);
  const auto fixed = onlookers(map, window.landmarks, window.keyframes, options.max_fixed);
  window.keyframes.insert(window.keyframes.end(), fixed.begin(), fixed.end());
  move_anchor_out_of_free(map, window);
  return window;
}

Window whole_component(const Map& map, std::uint32_t component) {
  Window window;
  map.for_each_keyframe([&](const Keyframe& k) {
    if (k.component == component) window.keyframes.push_back(k.id);
  });
  window.free = window.keyframes.size();
  window.landmarks = landmarks_seen_by(map, window.keyframes);
  move_anchor_out_of_free(map, window);
  return window;
}

/// A problem, and what its observations are in the map.
struct MappedProblem {
  BundleProblem problem;
  std::vector<std::pair<LandmarkId, KeyframeId>> observations;
};

BundleObservation bundle_observation(const Map& map, const Keyframe& keyframe,
                                     const Observation& o) {
  const Keypoint& k = keyframe.features->keypoints[o.keypoint];
  return {.u = k.u,
          .v = k.v,
          .depth = k.depth,
          .scale = static_cast<float>(map.pyramid().scale(k.level)),
          .weight = keyframe.static_weight[o.keypoint]};
}

MappedProblem make_problem(const Map& map, const Window& window) {
  MappedProblem mapped;
  BundleProblem& problem = mapped.problem;
  problem.camera = map.camera();
  std::map<KeyframeId, std::uint32_t> pose_of;
  for (std::size_t i = 0; i < window.keyframes.size(); ++i) {
    pose_of[window.keyframes[i]] = static_cast<std::uint32_t>(i);
    problem.T_world_camera.push_back(map.at(window.keyframes[i]).T_world_camera);
    problem.pose_fixed.push_back(i >= window.free);
  }
  for (std::uint32_t p = 0; p < window.landmarks.size(); ++p) {
    const Landmark& landmark = map.at(window.landmarks[p]);
    problem.points.push_back(landmark.p_world);
    for (const Observation& o : landmark.observations) {
      const auto pose = pose_of.find(o.keyframe);
      if (pose == pose_of.end()) continue;
      BundleObservation observation = bundle_observation(map, map.at(o.keyframe), o);
      observation.pose = pose->second;
      observation.point = p;
      problem.observations.push_back(observation);
      mapped.observations.emplace_back(landmark.id, o.keyframe);
    }
  }
  return mapped;
}

void apply(Map& map, const Window& window, const MappedProblem& mapped,
           const BundleResult& result) {
  for (std::size_t i = 0; i < window.free; ++i)
    map.set_pose(window.keyframes[i], result.T_world_camera[i]);
  for (std::size_t p = 0; p < window.landmarks.size(); ++p) {
    map.set_position(window.landmarks[p], result.points[p]);
  }
  for (std::size_t i = 0; i < mapped.observations.size(); ++i) {
    if (result.pixel_outlier[i])
      map.forget(mapped.observations[i].first, mapped.observations[i].second);
  }
  for (const LandmarkId id : window.landmarks) {
    if (map.find(id) != nullptr) map.refresh(id);
  }
}

BundleResult adjust(Map& map, const Window& window, const BundleOptions& options,
                    const StopRequest& stop) {
  const MappedProblem mapped = make_problem(map, window);
  BundleResult result = adjust_bundle(mapped.problem, options, stop);
  apply(map, window, mapped, result);
  return result;
}

}  // namespace

BundleResult adjust_locally(Map& map, KeyframeId newest, const LocalAdjustmentOptions& options,
                            const StopRequest& stop) {
  const Window window = local_window(map, newest, options);
  if (window.free == 0) return {};
  return adjust(map, window, options.bundle, stop);
}

BundleResult adjust_globally(Map& map, std::uint32_t component, const BundleOptions& options,
                             const StopRequest& stop) {
  const Window window = whole_component(map, component);
  if (window.free == 0) return {};
  return adjust(map, window, options, stop);
}

}  // namespace stillmap
