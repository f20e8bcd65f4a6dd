// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/node_matching.hpp"

#include <algorithm>
#include <tuple>

namespace stillmap {
namespace {

/// Maximum Hamming distance of a match, inclusive [bits].
constexpr int kMaxDistance = 60;
/// The best distance must be less than this times the second best within the node (Lowe 2004).
constexpr double kRatio = 0.8;

using Nodes = std::span<const NodeKeypoint>;

/// Removes and returns the entries of the first node of the direct index.
Nodes take_node(Nodes& rest) {
  std::size_t end = 0;
  while (end < rest.size() && rest[end].node == rest.front().node) ++end;
  const Nodes node = rest.first(end);
  rest = rest.subspan(end);
  return node;
}

void match_within(Nodes in_a, const Features& a, Nodes in_b, const Features& b,
                  std::vector<DescriptorMatch>& matches) {
  std::vector<std::uint32_t> candidates;
  for (const NodeKeypoint& n : in_b) candidates.push_back(n.keypoint);
  for (const NodeKeypoint& n : in_a) {
    const NearestTwo two = nearest_two(a.descriptors[n.keypoint], b.descriptors, candidates);
    if (two.best == kNoMatch || two.best_distance > kMaxDistance) continue;
    if (two.best_distance >= kRatio * two.second_distance) continue;
    matches.push_back({n.keypoint, two.best, two.best_distance});
  }
}

/// Keeps only the nearest match of each keypoint of b.
void keep_nearest(std::vector<DescriptorMatch>& matches) {
  std::sort(matches.begin(), matches.end(), [](const DescriptorMatch& x, const DescriptorMatch& y) {
    return std::tie(x.b, x.distance, x.a) < std::tie(y.b, y.distance, y.a);
  });
  const auto end =
      std::unique(matches.begin(), matches.end(),
                  [](const DescriptorMatch& x, const DescriptorMatch& y) { return x.b == y.b; });
  matches.erase(end, matches.end());
  std::sort(matches.begin(), matches.end(),
            [](const DescriptorMatch& x, const DescriptorMatch& y) { return x.a < y.a; });
}

}  // namespace

std::vector<DescriptorMatch> match_by_node(const BagOfWords& bag_a, const Features& a,
                                           const BagOfWords& bag_b, const Features& b) {
  std::vector<DescriptorMatch> matches;
  Nodes rest_a = bag_a.nodes, rest_b = bag_b.nodes;
  while (!rest_a.empty() && !rest_b.empty()) {
    if (rest_a.front().node < rest_b.front().node) {
      take_node(rest_a);
    } else if (rest_b.front().node < rest_a.front().node) {
      take_node(rest_b);
    } else {
      const Nodes node_a = take_node(rest_a), node_b = take_node(rest_b);
      match_within(node_a, a, node_b, b, matches);
    }
  }
  keep_nearest(matches);
  return keep_consistent_rotations(matches, a.keypoints, b.keypoints);
}

}  // namespace stillmap
