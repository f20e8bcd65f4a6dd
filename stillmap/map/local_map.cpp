// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/local_map.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace stillmap {
namespace {

/// Maximum number of keyframes: those covisible with the reference, then their neighbors.
constexpr std::size_t kMaxKeyframes = 60;
/// Number of best neighbors whose own neighbors are added.
constexpr std::size_t kSecondNeighbors = 10;
/// Minimum number of shared landmarks that makes two keyframes neighbors.
constexpr int kMinShared = 10;

/// Returns the reference, its neighbors, and the neighbors of its best neighbors, each once.
std::vector<KeyframeId> neighborhood(const Map& map, KeyframeId reference) {
  const auto full = [&](const auto& chosen) { return chosen.size() >= kMaxKeyframes; };
  std::vector<KeyframeId> chosen = {reference};
  std::vector<char> taken(1, 0);
  const auto take = [&](KeyframeId id) {
    if (id.slot >= taken.size()) taken.resize(id.slot + 1, 0);
    if (!full(chosen) && !taken[id.slot]) {
      taken[id.slot] = 1;
      chosen.push_back(id);
    }
  };
  if (reference.slot >= taken.size()) taken.resize(reference.slot + 1, 0);
  taken[reference.slot] = 1;

  const auto first = map.covisible(reference, kMinShared);
  for (const Covisible& neighbor : first) take(neighbor.keyframe);
  for (std::size_t i = 0; i < first.size() && !full(chosen); ++i) {
    if (i >= kSecondNeighbors) break;
    for (const Covisible& second : map.covisible(first[i].keyframe, kMinShared)) {
      take(second.keyframe);
    }
  }
  return chosen;
}

LocalLandmark copy(const Landmark& landmark) {
  return {landmark.id,
          landmark.p_world,
          landmark.normal,
          landmark.min_distance,
          landmark.max_distance,
          landmark.descriptor,
          static_cast<int>(landmark.observations.size()),
          landmark.static_log_odds};
}

}  // namespace

KeyframeId best_view(const Map& map, std::span<const LandmarkId> landmarks) {
  // Observation count and id by keyframe sequence number.
  std::map<std::uint32_t, std::pair<int, KeyframeId>> shown;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = id.valid() ? map.find(id) : nullptr;
    if (landmark == nullptr) continue;
    for (const Observation& o : landmark->observations) {
      auto& [count, keyframe] = shown[map.at(o.keyframe).sequence];
      keyframe = o.keyframe;
      ++count;
    }
  }
  std::pair<int, KeyframeId> best;
  for (const auto& [sequence, view] : shown) {
    if (view.first >= best.first) best = view;
  }
  return best.second;
}

LocalMapPtr make_local_map(const Map& map, KeyframeId reference) {
  const TraceScope scope("snapshot");
  auto local = std::make_shared<LocalMap>();
  local->reference = reference;
  local->depth_error = map.depth_error();
  const Keyframe& center = map.at(reference);
  const Keyframe* first = map.find(map.current_keyframe(map.first_of(center.component)));
  local->of_saved_map = center.component == map.components().front() && first != nullptr &&
                        first->session != map.session();
  local->made_for_frame = center.session == map.session() ? center.frame_index : 0;
  const auto keyframes = neighborhood(map, reference);
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = map.at(id);
    local->keyframes.push_back(
        {id, keyframe.T_world_camera, keyframe.features, keyframe.landmarks});
  }
  const auto seen = landmarks_seen_by(map, keyframes);
  local->landmarks.reserve(seen.size());
  for (const LandmarkId id : seen) local->landmarks.push_back(copy(map.at(id)));
  return local;
}

const LocalLandmark* LocalMap::find(LandmarkId id) const {
  const auto found =
      std::lower_bound(landmarks.begin(), landmarks.end(), id,
                       [](const LocalLandmark& l, LandmarkId key) { return l.id < key; });
  return found != landmarks.end() && found->id == id ? &*found : nullptr;
}

const LocalKeyframe* LocalMap::find(KeyframeId id) const {
  const auto found = std::find_if(keyframes.begin(), keyframes.end(),
                                  [&](const LocalKeyframe& k) { return k.id == id; });
  return found != keyframes.end() ? &*found : nullptr;
}

}  // namespace stillmap
