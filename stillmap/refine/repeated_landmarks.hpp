// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/map.hpp"

#include <span>

namespace stillmap {

/// Result of the removal of duplicates.
struct RepeatedReport {
  /// Number of compared pairs ("node-median") or of duplicate pairs found ("place").
  int pairs = 0;
  int gone = 0;  ///< Number of landmarks erased or merged into others.
};

/// Removal of repeated map points of the high/low-dynamics system (equation 9), by descriptor
/// alone. Each landmark that the keyframe observes is compared with the landmarks of `local` that
/// it does not observe and that belong to the same vocabulary node; d is the distance to the
/// nearest. With all such d of the keyframe, the local landmarks with
///
///     0 < d < median of all d
///
/// are erased. The paper applies this in every tracked frame; here landmarks are created at
/// keyframes and erased only by the mapper, so it is applied at keyframes. The paper does not state
/// the level of the nodes: kDirectIndexLevel is used, as for matching.
///
/// Known weakness of the formula: the median is relative, so nearly half of all d lie below it even
/// without duplicates, and landmarks are erased because they look like distant ones.
RepeatedReport remove_repeated_by_node(Map& map, KeyframeId keyframe,
                                       std::span<const LandmarkId> local,
                                       const Vocabulary& vocabulary);

/// Merges landmarks of `local` that agree in position and appearance: in the keyframe they project
/// to one point at one scale with one disparity, their descriptors are similar, they were seen from
/// the same side, and no keyframe observes both. Unlike fuse_duplicates() it needs no keypoint at
/// the projection, so it also finds landmarks whose corner is not detected in each other's
/// keyframes. The most similar pairs are merged first; the landmark with more observations stays.
RepeatedReport join_repeated_by_place(Map& map, KeyframeId keyframe,
                                      std::span<const LandmarkId> local);

}  // namespace stillmap
