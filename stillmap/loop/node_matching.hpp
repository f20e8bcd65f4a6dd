// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/matching.hpp"
#include "stillmap/feature/vocabulary.hpp"

#include <vector>

namespace stillmap {

/// Matches two images without a pose estimate: each keypoint of `a` with the nearest of `b` in the
/// same node of the vocabulary tree (Galvez-Lopez and Tardos, TRO 2012, section V.E). Only
/// keypoints in the bags take part, and only matches with a dominant change of angle are kept.
/// Every keypoint is matched at most once, to the nearest, the first of equals. Ordered by a.
std::vector<DescriptorMatch> match_by_node(const BagOfWords& bag_a, const Features& a,
                                           const BagOfWords& bag_b, const Features& b);

}  // namespace stillmap
