// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/local_adjustment.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/refine/map_bundle.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Maximum number of fixed keyframes that observe the same landmarks.
constexpr int kMaxFixed = 30;
/// Minimum number of landmarks that a neighbor shares with the newest keyframe.
constexpr int kMinShared = 15;

/// The part of the map that is optimized; list indices are those of the solver.
struct Window {
  std::vector<KeyframeId> keyframes;  ///< Optimized keyframes first, then fixed ones.
  std::size_t free = 0;
  std::vector<LandmarkId> landmarks;  ///< Sorted by id.
};

/// Returns the keyframes outside `inside` that observe the landmarks, by descending number of
/// observations.
std::vector<KeyframeId> observing_keyframes(const Map& map,
                                            const std::vector<LandmarkId>& landmarks,
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

/// The component's first keyframe or the fixed keyframes define the gauge; a window without either
/// fixes its oldest keyframe.
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

Window local_window(const Map& map, KeyframeId newest, int max_free) {
  Window window;
  window.keyframes = {newest};
  for (const Covisible& c : map.covisible(newest, kMinShared)) {
    if (window.keyframes.size() < static_cast<std::size_t>(max_free)) {
      window.keyframes.push_back(c.keyframe);
    }
  }
  window.free = window.keyframes.size();
  window.landmarks = landmarks_seen_by(map, window.keyframes);
  const auto fixed = observing_keyframes(map, window.landmarks, window.keyframes, kMaxFixed);
  window.keyframes.insert(window.keyframes.end(), fixed.begin(), fixed.end());
  move_anchor_out_of_free(map, window);
  return window;
}

}  // namespace

BundleResult adjust_locally(Map& map, KeyframeId newest, int max_free, const StopRequest& stop) {
  const TraceScope scope("local adjustment");
  const Window window = local_window(map, newest, max_free);
  if (window.free == 0) return {};
  const MapBundle bundle = make_bundle(map, window.keyframes, window.free, window.landmarks);
  BundleResult result = adjust_bundle(bundle.problem, stop);
  apply(map, bundle, result);
  return result;
}

}  // namespace stillmap
