// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/essential_graph.hpp"

#include "stillmap/base/disjoint_sets.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

namespace stillmap {
namespace {

/// Two keyframes, a < b by creation order, and their number of shared landmarks.
struct Link {
  std::uint32_t a, b;
  int shared;
};

std::vector<Link> strongest_first(const Map& map, const std::vector<KeyframeId>& keyframes,
                                  const std::map<KeyframeId, std::uint32_t>& node_of) {
  std::vector<Link> links;
  for (std::uint32_t a = 0; a < keyframes.size(); ++a) {
    for (const Covisible& c : map.covisible(keyframes[a])) {
      const auto b = node_of.find(c.keyframe);
      if (b != node_of.end() && a < b->second) links.push_back({a, b->second, c.shared});
    }
  }
  std::sort(links.begin(), links.end(), [](const Link& x, const Link& y) {
    return std::tuple(-x.shared, x.a, x.b) < std::tuple(-y.shared, y.a, y.b);
  });
  return links;
}

}  // namespace

EssentialGraph::EssentialGraph(const Map& map, std::uint32_t component, int strong)
    : keyframes_(keyframes_of(map, component)) {
  for (const KeyframeId id : keyframes_) {
    node_of_.emplace(id, static_cast<std::uint32_t>(T_world_keyframe_.size()));
    T_world_keyframe_.push_back(map.at(id).T_world_camera);
  }
  DisjointSets parts(keyframes_.size());
  for (const Link& link : strongest_first(map, keyframes_, node_of_)) {
    if (parts.unite(link.a, link.b) || link.shared >= strong) connect(link.a, link.b);
  }
  // Consecutive keyframes are connected even without shared landmarks, so the graph stays
  // connected.
  for (std::uint32_t i = 1; i < keyframes_.size(); ++i) {
    if (parts.unite(i - 1, i)) connect(i - 1, i);
  }
  for (const LoopEdge& loop : map.loops()) {
    if (node_of_.contains(loop.a) && node_of_.contains(loop.b)) connect(node(loop.a), node(loop.b));
  }
}

void EssentialGraph::connect(std::uint32_t a, std::uint32_t b) {
  edges_.push_back({a, b, T_world_keyframe_[a].inverse() * T_world_keyframe_[b], 1});
}

void EssentialGraph::add(KeyframeId a, KeyframeId b, const Pose& T_a_b, double weight) {
  edges_.push_back({node(a), node(b), T_a_b, weight});
}

// Dijkstra's algorithm.
double EssentialGraph::path_length(KeyframeId a, KeyframeId b) const {
  std::vector<std::vector<std::pair<std::uint32_t, double>>> neighbors(keyframes_.size());
  for (const PoseGraphEdge& edge : edges_) {
    const double length = edge.T_a_b.translation().norm();
    neighbors[edge.a].emplace_back(edge.b, length);
    neighbors[edge.b].emplace_back(edge.a, length);
  }
  std::vector<double> shortest(keyframes_.size(), std::numeric_limits<double>::infinity());
  std::set<std::pair<double, std::uint32_t>> open{{0, node(a)}};
  shortest[node(a)] = 0;
  while (!open.empty() && open.begin()->second != node(b)) {
    const auto [length, nearest] = *open.begin();
    open.erase(open.begin());
    for (const auto& [next, step] : neighbors[nearest]) {
      if (length + step >= shortest[next]) continue;
      open.erase({shortest[next], next});
      shortest[next] = length + step;
      open.insert({shortest[next], next});
    }
  }
  return shortest[node(b)];
}

std::map<KeyframeId, Pose> EssentialGraph::relaxed(const std::map<KeyframeId, Pose>& held) const {
  PoseGraphProblem problem{T_world_keyframe_, std::vector<std::uint8_t>(keyframes_.size(), 0),
                           edges_};
  for (const auto& [id, T] : held) {
    problem.T_world_node[node(id)] = T;
    problem.fixed[node(id)] = 1;
  }
  const PoseGraphResult result = solve_pose_graph(problem);
  std::map<KeyframeId, Pose> poses;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) poses[keyframes_[i]] = result.T_world_node[i];
  return poses;
}

}  // namespace stillmap
