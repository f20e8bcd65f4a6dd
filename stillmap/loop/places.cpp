// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/places.hpp"

#include <utility>

namespace stillmap {
namespace {

/// Per keypoint: its static weight, but 0 where it shows no landmark.
std::vector<float> weights_of_landmarks(const Keyframe& keyframe) {
  std::vector<float> weights = keyframe.static_weight;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) weights[i] = 0;
  }
  return weights;
}

}  // namespace

Places::Places(const PlaceOptions& options)
    : options_(options),
      index_(std::make_shared<const Vocabulary>(Vocabulary::built_in())),
      detector_(options.detector) {}

void Places::add(const Map& map, KeyframeId id) {
  index_.erase_missing(map);
  const Keyframe& keyframe = map.at(id);
  index_.insert(id, *keyframe.features, weights_of_landmarks(keyframe));
}

std::optional<LoopMatch> Places::recognise(const Map& map, KeyframeId newest) {
  if (!options_.loops) return std::nullopt;
  const std::uint32_t component = map.at(newest).component;
  if (component != std::exchange(component_, component)) detector_.reset();
  for (const PlaceCandidate& place : detector_.detect(map, index_, newest)) {
    auto verdict = verify_loop(map, index_, newest, place.keyframe, options_.verification);
    if (!verdict.match) continue;
    detector_.reset();
    return std::move(verdict.match);
  }
  return std::nullopt;
}

RelocalisationVerdict Places::find(const Map& map, const Frame& frame) const {
  return relocalise(map, index_, {*frame.features, frame.evidence.weight}, options_.relocaliser);
}

}  // namespace stillmap
