// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/pose_graph.hpp"

#include <map>
#include <vector>

namespace stillmap {

/// Number of shared landmarks that makes an edge of the essential graph (Mur-Artal, Montiel and
/// Tardos, TRO 2015, section III.D).
constexpr int kStrongEdge = 100;

/// Essential graph of a component (Mur-Artal, Montiel and Tardos, TRO 2015, section III.D): a
/// maximum spanning tree by shared landmarks, so that all keyframes are connected; every pair that
/// shares at least `strong` landmarks; and the loops closed earlier. Relative poses are taken from
/// the map at construction.
class EssentialGraph {
 public:
  /// @param strong  number of shared landmarks that makes an edge in addition to the tree
  EssentialGraph(const Map& map, std::uint32_t component, int strong = kStrongEdge);

  /// Adds a measured edge: T_a_b maps coordinates of keyframe b to keyframe a.
  void add(KeyframeId a, KeyframeId b, const Pose& T_a_b, double weight);

  /// Returns the poses that minimize the error of all edges.
  /// @param held  keyframes with fixed poses; all others are optimized
  std::map<KeyframeId, Pose> relaxed(const std::map<KeyframeId, Pose>& held) const;

  /// Returns the length of the shortest path along the edges [m].
  double path_length(KeyframeId a, KeyframeId b) const;

  /// In creation order.
  const std::vector<KeyframeId>& keyframes() const { return keyframes_; }
  /// Returns the pose of a keyframe at the construction of the graph.
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
