// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/feature/vocabulary.hpp"

#include <vector>

namespace stillmap {

struct NodeMatchOptions {
  int max_distance = 60;       ///< Hamming, inclusive
  double ratio = 0.8;          ///< best must be < ratio * second best within the node (Lowe 2004)
  bool check_rotation = true;  ///< keep only the dominant changes of angle
  STILLMAP_FIELDS(max_distance, ratio, check_rotation)
};

/// Matches two images without knowing where they were taken: each keypoint of `a` with the nearest
/// of `b` in the same node of the vocabulary tree (Galvez-Lopez and Tardos, TRO 2012, section V.E).
/// Only keypoints in the bags take part. Each keypoint of either is used once: of several that want
/// one, the nearest, of equals the first. Ordered by a.
std::vector<DescriptorMatch> match_by_node(const BagOfWords& bag_a, const Features& a,
                                           const BagOfWords& bag_b, const Features& b,
                                           const NodeMatchOptions& options = {});

}  // namespace stillmap
