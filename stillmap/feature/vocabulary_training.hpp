// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/vocabulary.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace stillmap {

struct VocabularyTrainingOptions {
  int branching = 10;   ///< Maximum number of children of a node, 2 to 255.
  int depth = 4;        ///< Number of levels below the root, 1 to 12.
  int iterations = 12;  ///< Maximum number of clustering iterations of one node.
  int seed = 1;         ///< Seed of the initial centers.
};

/// Trains a vocabulary from the descriptors of images, one vector per image: hierarchical
/// clustering in Hamming space, where the center of a cluster is the majority of each bit, which
/// minimizes the sum of distances (k-majority: Grana et al., A Fast Approach for Integrating ORB
/// Descriptors in the Bag of Words Model, SPIE 2013), with initial centers after Arthur and
/// Vassilvitskii (k-means++, SODA 2007). A node with no more descriptors than children becomes the
/// parent of all of them, and a node with equal descriptors a leaf. Weights are ln(images / images
/// with the word). Deterministic. Throws Error for options out of range and for fewer than two
/// different descriptors.
Vocabulary train_vocabulary(std::span<const std::vector<Descriptor>> images,
                            const VocabularyTrainingOptions& options = {});

}  // namespace stillmap
