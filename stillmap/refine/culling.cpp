// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/culling.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>

namespace stillmap {
namespace {

bool proved_itself(const Landmark& landmark, std::uint32_t now, const CullingOptions& options) {
  if (landmark.found < options.min_found_share * landmark.predicted) return false;
  if (landmark.static_log_odds < options.min_static_log_odds) return false;
  const bool on_trial =
      now < landmark.first_sequence + static_cast<std::uint32_t>(options.trial_keyframes);
  return on_trial ||
         landmark.observations.size() >= static_cast<std::size_t>(options.min_observations);
}

/// Returns whether enough other keyframes observe the landmark at the same or a finer level, that
/// is as closely.
bool observed_as_closely_by_others(const Map& map, const Landmark& landmark, KeyframeId keyframe,
                                   int level, const CullingOptions& options) {
  int others = 0;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == keyframe) continue;
    others += map.at(o.keyframe).features->keypoints[o.keypoint].level <= level + 1;
  }
  return others >= options.redundant_observers;
}

bool redundant(const Map& map, const Keyframe& keyframe, const CullingOptions& options) {
  int all = 0, seen_elsewhere = 0;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) continue;
    ++all;
    seen_elsewhere += observed_as_closely_by_others(map, map.at(keyframe.landmarks[i]), keyframe.id,
                                                    keyframe.features->keypoints[i].level, options);
  }
  return seen_elsewhere > options.redundant_share * all;
}

}  // namespace

int cull_landmarks(Map& map, KeyframeId newest, const CullingOptions& options) {
  const TraceScope scope("culling");
  std::vector<KeyframeId> nearby = {newest};
  for (const Covisible& c : map.covisible(newest, 5)) nearby.push_back(c.keyframe);
  const std::uint32_t now = map.at(newest).sequence;
  int culled = 0;
  for (const LandmarkId id : landmarks_seen_by(map, nearby)) {
    if (proved_itself(map.at(id), now, options)) continue;
    map.erase(id);
    ++culled;
  }
  return culled;
}

int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options) {
  const TraceScope scope("culling");
  const std::uint32_t now = map.at(newest).sequence;
  int culled = 0;
  for (const Covisible& c : map.covisible(newest, 5)) {
    const Keyframe& keyframe = map.at(c.keyframe);
    const bool recent = keyframe.sequence + static_cast<std::uint32_t>(options.keep_newest) > now;
    if (recent || map.is_first(c.keyframe) || !redundant(map, keyframe, options)) continue;
    map.erase(c.keyframe, map.covisible(c.keyframe).front().keyframe);
    ++culled;
  }
  return culled;
}

}  // namespace stillmap
