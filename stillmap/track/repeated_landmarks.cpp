// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/repeated_landmarks.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace stillmap {
namespace {

/// Landmarks of one node of the vocabulary, as indices in LocalMap::landmarks.
struct Node {
  std::vector<std::size_t> shown, others;
};

/// A landmark that the frame does not observe, with its descriptor distance from one that it does.
struct Candidate {
  int distance = 0;          // [bits]
  std::size_t landmark = 0;  // index in LocalMap::landmarks
};

/// Returns the median, for an even number of values the mean of the middle two.
/// @param values at least one
double median_of(std::vector<int> values) {
  std::sort(values.begin(), values.end());
  const std::size_t upper = values.size() / 2, lower = (values.size() - 1) / 2;
  return (values[lower] + values[upper]) / 2.0;
}

std::vector<Node> nodes_of(const LocalMap& local_map, const std::vector<PointMatch>& shown,
                           const Vocabulary& vocabulary) {
  std::vector<char> is_shown(local_map.landmarks.size(), 0);
  for (const PointMatch& match : shown) {
    if (match.landmark.valid()) is_shown[local_map.index(match.landmark)] = 1;
  }
  std::map<std::uint32_t, Node> by_node;
  for (std::size_t i = 0; i < is_shown.size(); ++i) {
    Node& node = by_node[vocabulary.node(local_map.landmarks[i].descriptor, kDirectIndexLevel)];
    (is_shown[i] != 0 ? node.shown : node.others).push_back(i);
  }
  std::vector<Node> nodes;
  for (auto& [number, node] : by_node) nodes.push_back(std::move(node));
  return nodes;
}

/// Returns the distances between a shown landmark and the others of its node.
std::vector<Candidate> candidates(const LocalMap& local_map, std::size_t shown, const Node& node) {
  std::vector<Candidate> all;
  const Descriptor& c = local_map.landmarks[shown].descriptor;
  for (const std::size_t l : node.others)
    all.push_back({distance(c, local_map.landmarks[l].descriptor), l});
  return all;
}

/// Returns the accepted match of each shown landmark of a node.
std::vector<Candidate> matches_in(const LocalMap& local_map, const Node& node) {
  std::vector<Candidate> matches;
  for (const std::size_t c : node.shown) {
    const auto all = candidates(local_map, c, node);
    const auto nearest = std::min_element(all.begin(), all.end(),
                                          [](auto& a, auto& b) { return a.distance < b.distance; });
    if (nearest != all.end() && nearest->distance <= kMaxRepeatDistance)
      matches.push_back(*nearest);
  }
  return matches;
}

std::vector<Candidate> pairs_in(const LocalMap& local_map, const Node& node) {
  std::vector<Candidate> pairs;
  for (const std::size_t c : node.shown) {
    const auto all = candidates(local_map, c, node);
    pairs.insert(pairs.end(), all.begin(), all.end());
  }
  return pairs;
}

/// Adds the landmarks whose distance is below the median of the set.
void add_below_median(const LocalMap& local_map, const std::vector<Candidate>& set,
                      std::set<LandmarkId>& repeated) {
  if (set.empty()) return;
  std::vector<int> distances;
  for (const Candidate& candidate : set) distances.push_back(candidate.distance);
  const double median = median_of(std::move(distances));
  for (const Candidate& candidate : set) {
    if (candidate.distance < median) repeated.insert(local_map.landmarks[candidate.landmark].id);
  }
}

}  // namespace

std::vector<LandmarkId> repeated_landmarks(const LocalMap& local_map,
                                           const std::vector<PointMatch>& shown, RepeatRule rule,
                                           const Vocabulary& vocabulary) {
  if (rule == RepeatRule::kNone) return {};
  const TraceScope scope("repeated landmarks");
  std::set<LandmarkId> repeated;
  std::vector<Candidate> matches;
  for (const Node& node : nodes_of(local_map, shown, vocabulary)) {
    if (rule == RepeatRule::kAllPairs) {
      add_below_median(local_map, pairs_in(local_map, node), repeated);
    } else {
      const auto here = matches_in(local_map, node);
      matches.insert(matches.end(), here.begin(), here.end());
    }
  }
  add_below_median(local_map, matches, repeated);
  return {repeated.begin(), repeated.end()};
}

}  // namespace stillmap
