// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/culling.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Minimum share of the frames that expected a landmark in which it was matched [0..1].
constexpr double kMinFoundShare = 0.25;
/// Landmarks with lower static log-odds, P(static) < 1/4, are culled.
constexpr double kMinStaticLogOdds = -1.1;
/// Number of keyframes after which a new landmark needs kMinObservations (Mur-Artal, Montiel and
/// Tardos, TRO 2015, section VI.B, with two observations instead of three).
constexpr std::uint32_t kTrialKeyframes = 2;
constexpr std::size_t kMinObservations = 2;
/// Share of a keyframe's landmarks observed as closely by kRedundantObservers others above which it
/// is culled [0..1], and that number of others (Mur-Artal, Montiel and Tardos, TRO 2015, section
/// VI.E).
constexpr double kRedundantShare = 0.9;
constexpr int kRedundantObservers = 3;
/// The same for keyframes of the map that a run extends, so that it does not grow with the visits:
/// see lab/records/saved_maps.md.
constexpr int kRedundantObserversOfEarlier = 2;
/// Number of newest keyframes that are never culled.
constexpr std::uint32_t kKeepNewest = 3;
/// Number of landmarks shared with the newest keyframe from which a keyframe is examined.
constexpr int kNearbyShared = 5;

bool proved_itself(const Landmark& landmark, std::uint32_t now) {
  if (landmark.found < kMinFoundShare * landmark.predicted) return false;
  if (landmark.static_log_odds < kMinStaticLogOdds) return false;
  const bool on_trial = now < landmark.first_sequence + kTrialKeyframes;
  return on_trial || landmark.observations.size() >= kMinObservations;
}

/// Returns whether at least `observers` other keyframes observe the landmark at the same or a finer
/// level, that is as closely.
bool observed_as_closely_by_others(const Map& map, const Landmark& landmark, KeyframeId keyframe,
                                   int level, int observers) {
  int others = 0;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == keyframe) continue;
    others += map.at(o.keyframe).features->keypoints[o.keypoint].level <= level + 1;
  }
  return others >= observers;
}

bool redundant(const Map& map, const Keyframe& keyframe, int observers) {
  int all = 0, seen_elsewhere = 0;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) continue;
    ++all;
    seen_elsewhere +=
        observed_as_closely_by_others(map, map.at(keyframe.landmarks[i]), keyframe.id,
                                      keyframe.features->keypoints[i].level, observers);
  }
  return seen_elsewhere > kRedundantShare * all;
}

/// Returns whether the keyframe was redundant and is erased.
bool erase_if_redundant(Map& map, KeyframeId id, int observers) {
  if (map.is_first(id) || !redundant(map, map.at(id), observers)) return false;
  map.erase(id, map.covisible(id).front().keyframe);
  return true;
}

}  // namespace

int cull_landmarks(Map& map, KeyframeId newest) {
  const TraceScope scope("culling");
  std::vector<KeyframeId> nearby = {newest};
  for (const Covisible& c : map.covisible(newest, kNearbyShared)) nearby.push_back(c.keyframe);
  const std::uint32_t now = map.at(newest).sequence;
  int culled = 0;
  for (const LandmarkId id : landmarks_seen_by(map, nearby)) {
    if (proved_itself(map.at(id), now)) continue;
    map.erase(id);
    ++culled;
  }
  return culled;
}

int cull_keyframes(Map& map, KeyframeId newest) {
  const TraceScope scope("culling");
  const std::uint32_t now = map.at(newest).sequence;
  int culled = 0;
  for (const Covisible& c : map.covisible(newest, kNearbyShared)) {
    const Keyframe& keyframe = map.at(c.keyframe);
    const bool recent = keyframe.sequence + kKeepNewest > now;
    const int observers =
        keyframe.session == map.session() ? kRedundantObservers : kRedundantObserversOfEarlier;
    if (!recent && erase_if_redundant(map, c.keyframe, observers)) ++culled;
  }
  return culled;
}

int cull_keyframes(Map& map) {
  int culled = 0;
  for (const std::uint32_t component : map.components()) {
    for (const KeyframeId id : keyframes_of(map, component))
      culled += erase_if_redundant(map, id, kRedundantObservers);
  }
  return culled;
}

}  // namespace stillmap
