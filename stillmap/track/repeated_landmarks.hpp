// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

namespace stillmap {

/// Elimination of duplicate map points of the high/low-dynamics system (Fu et al. 2024, section 1.3
/// and equation 9), applied in every frame while its local map is tracked.
///
/// The landmarks c that the frame shows are compared with all landmarks l of the local map in the
/// same node of the vocabulary tree by the Hamming distance of their descriptors, dist(c, l). A
/// landmark l that the frame does not show repeats another one if, in its node,
///
///     0 < dist(c, l) < median of all distances between the shown and the local landmarks
///
/// for one of the c. It is not searched in this frame and in any later one, and the mapper erases
/// it with the next keyframe. The paper does not state the level of the nodes: kDirectIndexLevel is
/// used, as for matching.
///
/// Known weakness of the formula: the median is relative, so landmarks are erased in every node
/// with two landmarks that the frame does not show, even if nothing is repeated.
class RepeatedLandmarks {
 public:
  RepeatedLandmarks() : vocabulary_(Vocabulary::built_in()) {}
  explicit RepeatedLandmarks(Vocabulary vocabulary) : vocabulary_(std::move(vocabulary)) {}

  /// Adds the landmarks of the local map that repeat those that the frame shows.
  /// @param shown matches of the frame; those without a landmark are ignored
  void find(const LocalMap& local_map, const std::vector<PointMatch>& shown);

  /// Returns whether a landmark of the local map of the last find() repeats another one.
  /// @param landmark index in LocalMap::landmarks
  bool contains(std::size_t landmark) const { return repeated_[landmark] != 0; }

  /// Returns the landmarks found since the last call.
  std::vector<LandmarkId> take();

 private:
  /// Landmarks of one node, as indices in LocalMap::landmarks.
  struct Node {
    std::vector<std::size_t> shown, others;
  };

  std::vector<Node> nodes_with_shown(const LocalMap& local_map, const std::vector<char>& shown);
  void compare(const LocalMap& local_map, const Node& node);

  Vocabulary vocabulary_;
  std::set<LandmarkId> found_;      // by all calls of find()
  std::vector<LandmarkId> newest_;  // since the last call of take()
  std::vector<char> repeated_;      // per landmark of the local map: 1 if in `found_`
};

}  // namespace stillmap
