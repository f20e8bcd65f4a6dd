// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <vector>

namespace stillmap {

/// Which distances of descriptors equation 9 of the high/low-dynamics system (Fu et al. 2024,
/// section 1.3) compares with their median; the paper does not state it.
enum class RepeatRule {
  kNone,
  /// Those of accepted matches: for each landmark that the frame shows, the distance to the nearest
  /// other landmark in its vocabulary node, if it is at most kMaxRepeatDistance. One median per
  /// frame.
  kMatched,
  /// Those of all pairs of a shown and another landmark in a node; one median per node.
  kAllPairs,
};

/// Largest Hamming distance of a landmark from the one that it repeats: that of a match between
/// keyframes in ORB-SLAM (TH_LOW) [bits of 256].
inline constexpr int kMaxRepeatDistance = 50;

/// Returns the landmarks of the local map that repeat landmarks that a frame shows, by id.
///
/// A point on an object that has moved is mapped again at its new place. So the landmarks c that
/// the frame shows are matched with the other landmarks l of the local map, within the nodes of the
/// vocabulary that accelerate ORB-SLAM's matching, by dist(c, l) = Hamming distance of their
/// descriptors (equation 9). Distances below the median of the set of distances mark repeated
/// landmarks. The paper excludes the distance 0, that of a landmark from itself; here identity is
/// decided by id, so that exact copies are found. A landmark that the frame shows is never a
/// repeat. The paper does not state the level of the nodes: kDirectIndexLevel is used, as for
/// matching.
/// @param shown matches of the frame; those without a landmark are ignored
std::vector<LandmarkId> repeated_landmarks(const LocalMap& local_map,
                                           const std::vector<PointMatch>& shown, RepeatRule rule,
                                           const Vocabulary& vocabulary);

}  // namespace stillmap
