// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/vocabulary.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace stillmap {

struct VocabularyTrainingOptions {
  int branching = 10;   ///< children of a node at most, 2 to 255
  int depth = 4;        ///< levels below the root, 1 to 12
  int iterations = 12;  ///< of the clustering of one node, at most
  int seed = 1;         ///< of the first centers
  STILLMAP_FIELDS(branching, depth, iterations, seed)
};

/// Learns a vocabulary from the descriptors of images, one vector per image: hierarchical
/// clustering in Hamming space, the center of a cluster being the majority of each bit, which
/// minimizes the sum of distances (k-majority: Grana et al., A Fast Approach for Integrating ORB
/// Descriptors in the Bag of Words Model, SPIE 2013), with first centers after Arthur and
/// Vassilvitskii (k-means++, SODA 2007). A node with no more descriptors than children becomes a
/// parent of them all, and one whose descriptors are equal a leaf. Weights are ln(images / images
/// with the word). Deterministic: the same descriptors and options give the same bytes. Throws
/// Error for options out of range and for fewer than two different descriptors.
Vocabulary train_vocabulary(std::span<const std::vector<Descriptor>> images,
                            const VocabularyTrainingOptions& options = {});

}  // namespace stillmap
