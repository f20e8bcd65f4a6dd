// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/places.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/loop/tag_matching.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace stillmap {
namespace {

/// Returns one weight per keypoint: its static weight, or 0 if it shows no landmark.
std::vector<float> weights_of_landmarks(const Keyframe& keyframe) {
  std::vector<float> weights = keyframe.static_weight;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) weights[i] = 0;
  }
  return weights;
}

/// Returns the keyframes of a component that show most landmarks.
std::vector<KeyframeId> richest(const Map& map, std::uint32_t component, int most) {
  std::vector<std::pair<std::ptrdiff_t, KeyframeId>> shown;
  for (const KeyframeId id : keyframes_of(map, component)) {
    const auto& landmarks = map.at(id).landmarks;
    shown.emplace_back(
        std::count_if(landmarks.begin(), landmarks.end(), [](LandmarkId l) { return l.valid(); }),
        id);
  }
  std::stable_sort(shown.begin(), shown.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<KeyframeId> ids;
  for (const auto& [count, id] : shown) {
    if (std::ssize(ids) < most) ids.push_back(id);
  }
  return ids;
}

}  // namespace

Places::Places(const PlaceOptions& options)
    : options_(options),
      index_(std::make_shared<const Vocabulary>(Vocabulary::built_in())),
      detector_(options.consistent) {}

void Places::add(const Map& map, KeyframeId id) {
  const TraceScope scope("index");
  index_.erase_missing(map);
  const Keyframe& keyframe = map.at(id);
  index_.insert(id, *keyframe.features, weights_of_landmarks(keyframe));
}

std::optional<LoopMatch> Places::recognize(const Map& map, KeyframeId newest) {
  if (!options_.loops) return std::nullopt;
  const std::uint32_t component = map.at(newest).component;
  if (component != std::exchange(component_, component)) detector_.reset();
  for (const PlaceCandidate& place : detector_.detect(map, index_, newest)) {
    auto verification = verify(map, newest, place.keyframe);
    if (!verification.match) continue;
    detector_.reset();
    return std::move(verification.match);
  }
  auto match = options_.connect_at_once ? match_other_component(map, newest) : std::nullopt;
  if (!match) match = match_tags(map, newest);
  if (match) detector_.reset();
  return match;
}

/// Returns a verified loop or merge that the tags of a keyframe find.
std::optional<LoopMatch> Places::match_tags(const Map& map, KeyframeId query) {
  for (const KeyframeId place : places_with_same_tags(map, query)) {
    auto verification = verify_tags(map, query, place);
    if (verification.match) return std::move(verification.match);
  }
  return std::nullopt;
}

std::vector<PlaceCandidate> Places::places_in_other_components(const Map& map,
                                                               KeyframeId query) const {
  const BagOfWords* bag = index_.find(query);
  if (bag == nullptr) return {};
  std::vector<KeyframeId> own = keyframes_of(map, map.at(query).component);
  if (own.size() == map.keyframe_count()) return {};
  std::sort(own.begin(), own.end());
  return find_places(map, index_, bag->words, own, 0);
}

std::vector<PlaceComparison> Places::compare_components(const Map& map) const {
  std::vector<PlaceComparison> comparisons;
  map.for_each_keyframe([&](const Keyframe& query) {
    std::set<std::uint32_t> verified;
    for (const PlaceCandidate& place : places_in_other_components(map, query.id)) {
      const std::uint32_t component = map.at(place.keyframe).component;
      if (verified.contains(component)) continue;
      comparisons.push_back({query.id, place.keyframe, verify(map, query.id, place.keyframe)});
      if (comparisons.back().verification.match) verified.insert(component);
    }
    for (const KeyframeId place : places_with_same_tags(map, query.id)) {
      const std::uint32_t component = map.at(place).component;
      if (component != query.component && !verified.contains(component))
        comparisons.push_back({query.id, place, verify_tags(map, query.id, place)});
    }
  });
  return comparisons;
}

/// Returns a verified merge that a single keyframe finds.
std::optional<LoopMatch> Places::match_other_component(const Map& map, KeyframeId query) const {
  for (const PlaceCandidate& place : places_in_other_components(map, query)) {
    auto verification = verify(map, query, place.keyframe);
    if (verification.match) return std::move(verification.match);
  }
  return std::nullopt;
}

std::optional<LoopMatch> Places::connect(const Map& map, std::uint32_t component) const {
  if (!options_.loops) return std::nullopt;
  for (const KeyframeId query : richest(map, component, options_.connect_by)) {
    if (auto match = match_other_component(map, query)) return match;
  }
  for (const KeyframeId query : keyframes_of(map, component)) {
    auto match = match_tags(map, query);
    if (match && !match->same_component) return match;
  }
  return std::nullopt;
}

std::string Places::why_unknown(const Map& map, KeyframeId query) const {
  if (!options_.loops) return "the options disable loop closing";
  LoopVerification closest{.match = {}, .reason = "no keyframes look alike", .passed = -1};
  for (const PlaceCandidate& place : places_in_other_components(map, query)) {
    LoopVerification verification = verify(map, query, place.keyframe);
    if (verification.passed > closest.passed) closest = std::move(verification);
  }
  return closest.reason;
}

RelocalizationVerification Places::find(const Map& map, const Frame& frame) const {
  return relocalize(map, index_, {*frame.features, frame.evidence.weight});
}

}  // namespace stillmap
