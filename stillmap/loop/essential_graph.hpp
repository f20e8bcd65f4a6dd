// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/pose_graph.hpp"

#include <map>
#include <vector>

namespace stillmap {

/// How a component's keyframes stand to each other: few strong edges that say nearly as much as all
/// observations do (essential graph: Mur-Artal, Montiel and Tardos, TRO 2015, section III.D). A
/// maximum spanning tree of the landmarks shared, so that all hang together; every pair that shares
/// `strong` or more; and the loops closed before. Relative poses are the map's of the moment.
class EssentialGraph {
 public:
  /// @param strong  landmarks that two keyframes share, for an edge beside the tree
  EssentialGraph(const Map& map, std::uint32_t component, int strong);

  /// Adds what has been measured since: from a, b is seen at T_a_b.
  void add(KeyframeId a, KeyframeId b, const Pose& T_a_b, double weight);

  /// The poses that fit all edges best.
  /// @param held  keyframes whose poses are known; all others give way
  std::map<KeyframeId, Pose> relaxed(const std::map<KeyframeId, Pose>& held,
                                     const PoseGraphOptions& options) const;

  /// In the order of their making.
  const std::vector<KeyframeId>& keyframes() const { return keyframes_; }
  /// A keyframe's pose when the graph was made.
  const Pose& pose(KeyframeId id) const { return T_world_keyframe_[node(id)]; }
  std::size_t edges() const { return edges_.size(); }

 private:
  void connect(std::uint32_t a, std::uint32_t b);
  std::uint32_t node(KeyframeId id) const { return node_of_.at(id); }

  std::vector<KeyframeId> keyframes_;
  std::vector<Pose> T_world_keyframe_;
  std::map<KeyframeId, std::uint32_t> node_of_;
  std::vector<PoseGraphEdge> edges_;
};

}  // namespace stillmap
