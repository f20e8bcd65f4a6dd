// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/place_index.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Number of best covisible keyframes that form an island with a keyframe.
constexpr int kGroup = 10;
/// Maximum number of candidates of one component.
constexpr int kMaxOfComponent = 5;
/// Maximum number of candidates of all components together.
constexpr std::size_t kMaxOfAll = 15;
/// Maximum number of keyframes that are evaluated, those of highest score.
constexpr int kMaxScored = 60;

bool contains(std::span<const KeyframeId> sorted, KeyframeId id) {
  return std::binary_search(sorted.begin(), sorted.end(), id);
}

/// Score by keyframe, for all possible candidates.
using ScoreOf = std::map<KeyframeId, double>;

ScoreOf eligible_scores(const Map& map, const PlaceIndex& index, const BowVector& query,
                        std::span<const KeyframeId> excluded) {
  ScoreOf scores;
  for (const PlaceScore& s : index.scores(query)) {
    if (map.find(s.keyframe) != nullptr && !contains(excluded, s.keyframe))
      scores.emplace_hint(scores.end(), s.keyframe, s.score);
  }
  return scores;
}

/// Returns the keyframes of highest score, best first.
std::vector<PlaceScore> best_of(const Map& map, const ScoreOf& scores, double min_score, int most) {
  std::vector<PlaceScore> best;
  for (const auto& [id, score] : scores) {
    if (score >= min_score) best.push_back({id, score});
  }
  std::sort(best.begin(), best.end(), [&](const PlaceScore& a, const PlaceScore& b) {
    if (a.score != b.score) return a.score > b.score;
    return map.at(a.keyframe).sequence < map.at(b.keyframe).sequence;
  });
  best.resize(std::min(best.size(), static_cast<std::size_t>(std::max(most, 0))));
  return best;
}

/// Keyframes of one place and the best of them.
struct Island {
  PlaceCandidate best;
  std::vector<KeyframeId> members;
};

/// Returns the island around a keyframe.
Island island_around(const Map& map, const PlaceScore& center, const ScoreOf& scores, int size) {
  Island island{{center.keyframe, center.score, center.score}, {center.keyframe}};
  int counted = 0;
  for (const Covisible& c : map.covisible(center.keyframe)) {
    if (counted++ == size) break;
    const auto found = scores.find(c.keyframe);
    if (found == scores.end()) continue;
    island.members.push_back(c.keyframe);
    island.best.island_score += found->second;
    if (found->second > island.best.score) {
      island.best.keyframe = c.keyframe;
      island.best.score = found->second;
    }
  }
  return island;
}

/// Returns the candidates, best first; an island whose best keyframe lies on a better island
/// belongs to that one.
std::vector<PlaceCandidate> separate(const Map& map, std::vector<Island> islands) {
  std::sort(islands.begin(), islands.end(), [&](const Island& a, const Island& b) {
    if (a.best.island_score != b.best.island_score)
      return a.best.island_score > b.best.island_score;
    return map.at(a.best.keyframe).sequence < map.at(b.best.keyframe).sequence;
  });
  std::vector<PlaceCandidate> kept;
  std::vector<KeyframeId> covered;
  for (const Island& island : islands) {
    if (std::find(covered.begin(), covered.end(), island.best.keyframe) == covered.end())
      kept.push_back(island.best);
    covered.insert(covered.end(), island.members.begin(), island.members.end());
  }
  return kept;
}

/// Returns the best places of each component, best first; components ordered by the score of their
/// best keyframe.
std::vector<std::vector<PlaceCandidate>> of_each_component(const Map& map,
                                                           const std::vector<PlaceCandidate>& all,
                                                           double island_share) {
  std::map<std::uint32_t, std::vector<PlaceCandidate>> by_component;
  for (const PlaceCandidate& place : all) {
    auto& kept = by_component[map.at(place.keyframe).component];
    const bool alike =
        kept.empty() || place.island_score >= island_share * kept.front().island_score;
    if (alike && std::ssize(kept) < kMaxOfComponent) kept.push_back(place);
  }
  std::vector<std::vector<PlaceCandidate>> components;
  for (auto& [component, kept] : by_component) components.push_back(std::move(kept));
  std::stable_sort(components.begin(), components.end(),
                   [](const auto& a, const auto& b) { return a.front().score > b.front().score; });
  return components;
}

/// Returns the first of each list, then the second of each, and so on.
std::vector<PlaceCandidate> interleaved(const std::vector<std::vector<PlaceCandidate>>& lists) {
  std::vector<PlaceCandidate> all;
  for (std::size_t rank = 0, before = 0; rank == 0 || all.size() != before; ++rank) {
    before = all.size();
    for (const auto& list : lists) {
      if (rank < list.size()) all.push_back(list[rank]);
    }
  }
  return all;
}

}  // namespace

void PlaceIndex::insert(KeyframeId id, const Features& features, std::span<const float> weights) {
  erase(id);
  BagOfWords bag = vocabulary_->transform(features.descriptors, weights);
  for (const WordWeight& w : bag.words) {
    auto& entries = keyframes_with_[w.word];
    const auto at =
        std::lower_bound(entries.begin(), entries.end(), id,
                         [](const Entry& entry, KeyframeId key) { return entry.keyframe < key; });
    entries.insert(at, {id, w.weight});
  }
  bags_.emplace(id, std::move(bag));
}

void PlaceIndex::erase(KeyframeId id) {
  const auto found = bags_.find(id);
  if (found == bags_.end()) return;
  for (const WordWeight& w : found->second.words) {
    std::erase_if(keyframes_with_[w.word], [&](const Entry& e) { return e.keyframe == id; });
  }
  bags_.erase(found);
}

void PlaceIndex::erase_missing(const Map& map) {
  std::vector<KeyframeId> missing;
  for (const auto& [id, bag] : bags_) {
    if (map.find(id) == nullptr) missing.push_back(id);
  }
  for (const KeyframeId id : missing) erase(id);
}

const BagOfWords* PlaceIndex::find(KeyframeId id) const {
  const auto found = bags_.find(id);
  return found != bags_.end() ? &found->second : nullptr;
}

std::vector<PlaceScore> PlaceIndex::scores(const BowVector& query) const {
  // Every keyframe's sum is accumulated in the order of words, so it is deterministic.
  std::map<KeyframeId, double> sums;
  for (const WordWeight& w : query) {
    for (const Entry& entry : keyframes_with_[w.word])
      sums[entry.keyframe] += std::min(w.weight, entry.weight);
  }
  std::vector<PlaceScore> result;
  for (const auto& [id, sum] : sums) result.push_back({id, sum});
  return result;
}

std::vector<PlaceCandidate> find_places(const Map& map, const PlaceIndex& index,
                                        const BowVector& query,
                                        std::span<const KeyframeId> excluded, double min_score,
                                        double island_share) {
  const ScoreOf scores = eligible_scores(map, index, query, excluded);
  std::vector<Island> islands;
  for (const PlaceScore& center : best_of(map, scores, min_score, kMaxScored))
    islands.push_back(island_around(map, center, scores, kGroup));
  std::vector<PlaceCandidate> places =
      interleaved(of_each_component(map, separate(map, std::move(islands)), island_share));
  places.resize(std::min(places.size(), kMaxOfAll));
  return places;
}

}  // namespace stillmap
