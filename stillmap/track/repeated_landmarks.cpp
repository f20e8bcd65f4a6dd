// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/repeated_landmarks.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <map>

namespace stillmap {
namespace {

/// Distance above those of all descriptors [bits].
constexpr int kNoDistance = 257;

/// Returns the median, for an even number of values the mean of the middle two.
/// @param values at least one
double median_of(std::vector<int> values) {
  std::sort(values.begin(), values.end());
  const std::size_t upper = values.size() / 2, lower = (values.size() - 1) / 2;
  return (values[lower] + values[upper]) / 2.0;
}

}  // namespace

/// Returns the nodes with a landmark that the frame shows.
std::vector<RepeatedLandmarks::Node> RepeatedLandmarks::nodes_with_shown(
    const LocalMap& local_map, const std::vector<char>& shown) {
  std::map<std::uint32_t, Node> by_node;
  for (std::size_t i = 0; i < local_map.landmarks.size(); ++i) {
    if (repeated_[i] != 0) continue;
    const auto number = vocabulary_.node(local_map.landmarks[i].descriptor, kDirectIndexLevel);
    Node& node = by_node[number];
    (shown[i] != 0 ? node.shown : node.others).push_back(i);
  }
  std::vector<Node> nodes;
  for (auto& [number, node] : by_node) {
    if (!node.shown.empty() && !node.others.empty()) nodes.push_back(std::move(node));
  }
  return nodes;
}

void RepeatedLandmarks::compare(const LocalMap& local_map, const Node& node) {
  const auto& landmarks = local_map.landmarks;
  std::vector<int> distances;
  std::vector<std::pair<int, std::size_t>> nearest;  // of each other landmark, above 0
  for (const std::size_t l : node.others) {
    int least = kNoDistance;
    for (const std::size_t c : node.shown) {
      const int d = distance(landmarks[c].descriptor, landmarks[l].descriptor);
      distances.push_back(d);
      if (d > 0) least = std::min(least, d);
    }
    nearest.emplace_back(least, l);
  }
  const double median = median_of(std::move(distances));
  for (const auto& [least, l] : nearest) {
    if (least >= median) continue;
    repeated_[l] = 1;
    found_.insert(landmarks[l].id);
    newest_.push_back(landmarks[l].id);
  }
}

void RepeatedLandmarks::find(const LocalMap& local_map, const std::vector<PointMatch>& shown) {
  const TraceScope scope("repeated landmarks");
  repeated_.assign(local_map.landmarks.size(), 0);
  std::vector<char> is_shown(local_map.landmarks.size(), 0);
  for (std::size_t i = 0; i < repeated_.size(); ++i)
    repeated_[i] = found_.contains(local_map.landmarks[i].id) ? 1 : 0;
  for (const PointMatch& match : shown) {
    if (match.landmark.valid()) is_shown[local_map.index(match.landmark)] = 1;
  }
  for (const Node& node : nodes_with_shown(local_map, is_shown)) compare(local_map, node);
}

std::vector<LandmarkId> RepeatedLandmarks::take() { return std::exchange(newest_, {}); }

}  // namespace stillmap
