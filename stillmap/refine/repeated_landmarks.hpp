// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/map.hpp"

#include <span>
#include <string>

namespace stillmap {

/// What is done about landmarks that are one thing twice, beside fuse_duplicates().
struct RepeatedOptions {
  /// "none"; "node-median": remove_repeated_by_node(), as the high/low-dynamics system does; or
  /// "place": join_repeated_by_place().
  std::string rule = "none";
  double radius = 2.0;         ///< "place": between the two projections [pixels at level 0]
  double max_disparity = 1.0;  ///< "place": between the two predicted disparities [pixels]
  int max_distance = 50;       ///< "place": Hamming distance of two views of one thing
  double min_normal_cosine =
      0.5;  ///< "place": between the two mean viewing directions: seen from one side
  STILLMAP_FIELDS(rule, radius, max_disparity, max_distance, min_normal_cosine)
};

/// What came of it.
struct RepeatedReport {
  int pairs = 0;  ///< that were compared: "node-median"; or that are one thing by place and looks
  int gone = 0;   ///< landmarks erased, or merged into others
};

/// Throws Error for a rule that there is not.
void check_rule(const RepeatedOptions& options);

/// The high/low-dynamics system's removal of repeated map points (equation 9), by descriptor alone.
/// Each landmark that the keyframe sees is compared with those of `local` that it does not see and
/// that fall into the same node of the vocabulary tree; d is the distance to the nearest. With all
/// such d of the keyframe, the local landmarks with
///
///     0 < d < median of all d
///
/// are erased. The paper does so in every tracked frame; landmarks only come into being at
/// keyframes and only the mapper may erase them, so here it is done at those. Which level the nodes
/// are of it does not say: kDirectIndexLevel, where matches are sought, too.
///
/// Known from the formula: the median is relative, so that nearly half of all d lie below it
/// whether anything is repeated or not, and landmarks go for looking like another one far away.
RepeatedReport remove_repeated_by_node(Map& map, KeyframeId keyframe,
                                       std::span<const LandmarkId> local,
                                       const Vocabulary& vocabulary);

/// Joins landmarks of `local` that are one thing by place and looks: seen from the keyframe they
/// project to one point of one scale with one disparity, their descriptors are near, they were seen
/// from the same side, and no keyframe sees both (which would tell them apart). Unlike
/// fuse_duplicates() it needs no keypoint where a landmark is looked for, so it also finds those
/// whose corner is not detected in each other's keyframes. The more alike are joined first; the one
/// with more observations stays.
RepeatedReport join_repeated_by_place(Map& map, KeyframeId keyframe,
                                      std::span<const LandmarkId> local,
                                      const RepeatedOptions& options);

}  // namespace stillmap
