// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <vector>

namespace stillmap {

/// Set of descriptor distances whose median is the limit in equation 9 of the paper of preset
/// gated-seg (Fu et al. 2024, section 1.3). The paper does not define the set.
enum class RepeatRule {
  kNone,
  /// Accepted matches: the distance of each landmark that the frame observes to the nearest other
  /// landmark in its vocabulary node, if it is at most kMaxRepeatDistance. One median per frame.
  kMatched,
  /// All pairs of an observed and another landmark in a node. One median per node.
  kAllPairs,
};

/// Largest Hamming distance between a landmark and the one that it repeats [bits of 256]: the limit
/// of ORB-SLAM for matches between keyframes (TH_LOW).
inline constexpr int kMaxRepeatDistance = 50;

/// Returns the landmarks of the local map that repeat landmarks observed by a frame, sorted by id.
///
/// A point on an object that has moved is mapped again at its new place. Therefore the landmarks c
/// that the frame observes are compared with the other landmarks l of the local map in the same
/// vocabulary node, by the Hamming distance of their descriptors, dist(c, l) (equation 9). A
/// landmark l whose distance is below the median of the set is a repeat. The paper excludes the
/// distance 0, that of a landmark from itself; here landmarks are distinguished by id, so exact
/// copies are found. A landmark that the frame observes is never a repeat. The paper does not state
/// the level of the nodes: kDirectIndexLevel is used, as for matching.
/// @param shown matches of the frame; those without a landmark are ignored
std::vector<LandmarkId> repeated_landmarks(const LocalMap& local_map,
                                           const std::vector<PointMatch>& shown, RepeatRule rule,
                                           const Vocabulary& vocabulary);

}  // namespace stillmap
