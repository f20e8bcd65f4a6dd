// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/loop_detector.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Minimum ratio of a candidate's score to the query's best score with a neighbor, since the
/// similarity of two views of one place depends on the place (Galvez-Lopez and Tardos, TRO 2012,
/// eq. 3). Chosen by measurement, see lab/records/loops.md.
constexpr double kRelativeScore = 0.4;
/// Number of shared landmarks that makes a keyframe a neighbor of the query or part of a
/// candidate's group.
constexpr int kMinShared = 15;

/// Returns the keyframe and those that share at least `min_shared` landmarks with it, sorted by id.
std::vector<KeyframeId> with_covisible(const Map& map, KeyframeId id, int min_shared) {
  std::vector<KeyframeId> group = {id};
  for (const Covisible& c : map.covisible(id, min_shared)) group.push_back(c.keyframe);
  std::sort(group.begin(), group.end());
  return group;
}

bool meet(const std::vector<KeyframeId>& a, const std::vector<KeyframeId>& b) {
  auto i = a.begin(), j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (*i == *j) return true;
    *i < *j ? ++i : ++j;
  }
  return false;
}

/// Returns the score that a candidate must reach, derived from the query's neighbors; 0 without
/// neighbors.
double score_to_reach(const Map& map, const PlaceIndex& index, KeyframeId query) {
  const BagOfWords* bag = index.find(query);
  if (bag == nullptr) return 0;
  double best = 0;
  for (const Covisible& c : map.covisible(query, kMinShared)) {
    if (const BagOfWords* other = index.find(c.keyframe))
      best = std::max(best, similarity(bag->words, other->words));
  }
  return kRelativeScore * best;
}

}  // namespace

LoopDetector::Chain LoopDetector::continued(const Map& map, KeyframeId candidate) const {
  Chain chain{with_covisible(map, candidate, kMinShared), 1};
  for (const Chain& before : chains_) {
    if (meet(before.group, chain.group)) chain.length = std::max(chain.length, before.length + 1);
  }
  return chain;
}

std::vector<PlaceCandidate> LoopDetector::detect(const Map& map, const PlaceIndex& index,
                                                 KeyframeId query) {
  const TraceScope scope("query");
  const BagOfWords* bag = index.find(query);
  if (bag == nullptr) return {};
  const auto surroundings = with_covisible(map, query, 1);
  const double least = score_to_reach(map, index, query);
  const auto there_are = static_cast<int>(keyframes_of(map, map.at(query).component).size());
  const int wanted = std::min(consistent_, there_are);
  std::vector<Chain> chains;
  std::vector<PlaceCandidate> counting;
  for (const PlaceCandidate& candidate : find_places(map, index, bag->words, surroundings, least)) {
    chains.push_back(continued(map, candidate.keyframe));
    if (chains.back().length >= wanted) counting.push_back(candidate);
  }
  chains_ = std::move(chains);
  return counting;
}

}  // namespace stillmap
