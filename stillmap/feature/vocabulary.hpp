// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A visual word of an image and its weight.
struct WordWeight {
  std::uint32_t word = 0;
  float weight = 0;  ///< Positive weight.
  bool operator==(const WordWeight&) const = default;
};

/// Bag of words of an image, sorted by word; the weights sum to 1. Empty without usable keypoints.
using BowVector = std::vector<WordWeight>;

/// Returns the similarity of two images, 0 to 1: 1 - |a - b| / 2 in the L1 norm (Galvez-Lopez and
/// Tardos, Bags of Binary Words, TRO 2012, eq. 2), which for vectors that sum to 1 is sum min(a_i,
/// b_i).
double similarity(const BowVector& a, const BowVector& b);

/// Keypoint `keypoint` belongs to node `node` of the vocabulary tree.
struct NodeKeypoint {
  std::uint32_t node = 0, keypoint = 0;
  auto operator<=>(const NodeKeypoint&) const = default;
};

/// Bag of words and direct index of an image.
struct BagOfWords {
  BowVector words;
  /// Direct index: the usable keypoints by node of one level, then by keypoint. Keypoints of two
  /// images that show the same point mostly belong to the same node, so matches are searched there.
  std::vector<NodeKeypoint> nodes;
};

/// Level of the tree for the direct index: level 2 has about branching^2 nodes. Chosen by
/// measurement, see vocabulary_test.cpp and lab/records/loops.md.
inline constexpr int kDirectIndexLevel = 2;

/// A tree of binary descriptors (Nister and Stewenius, Scalable Recognition with a Vocabulary Tree,
/// CVPR 2006): from the root a descriptor follows the nearest child to a leaf, its word. Words are
/// weighted by TF-IDF (Sivic and Zisserman, Video Google, ICCV 2003). Immutable and thread-safe.
/// Written by hand: Debian packages neither DBoW2 nor FBoW.
class Vocabulary {
 public:
  /// One node, in level order; children of a node are consecutive.
  struct Node {
    std::uint32_t first_child = 0;
    std::uint32_t children = 0;  ///< Number of children; 0: a leaf.
    std::uint32_t word = 0;      ///< Word of a leaf: 0, 1, 2, ... in node order.
  };

  /// Creates a vocabulary from the numbers of children of all nodes in level order, the root first.
  /// @param descriptors  one per node except the root, in the same order
  /// @param idf          one per leaf, in order: ln(images / images with the word), >= 0
  /// Throws Error if they do not form one tree.
  Vocabulary(std::vector<std::uint8_t> children, std::vector<Descriptor> descriptors,
             std::vector<float> idf);

  std::size_t words() const { return idf_.size(); }
  std::size_t nodes() const { return nodes_.size(); }
  int depth() const { return depth_; }  ///< Number of levels below the root.
  float idf(std::uint32_t word) const { return idf_[word]; }

  /// Returns the word of a descriptor; ties in favor of the first child.
  std::uint32_t word(const Descriptor& descriptor) const { return nodes_[leaf(descriptor)].word; }
  /// Returns the node `level` steps below the root on the path to the word, or the leaf if it comes
  /// first.
  std::uint32_t node(const Descriptor& descriptor, int level) const;

  /// Returns the TF-IDF weighted, L1-normalized words of an image and its direct index.
  /// @param weights  one per descriptor: those with weight 0 or less are ignored; empty: all are
  /// used
  BagOfWords transform(std::span<const Descriptor> descriptors, std::span<const float> weights = {},
                       int direct_level = kDirectIndexLevel) const;

  /// Returns the bytes of the file format in vocabulary_file.cpp. Equal vocabularies give equal
  /// bytes.
  std::string bytes() const;
  /// @param where  name of the source for error messages
  /// Throws Error if the bytes are not a vocabulary, of a newer version, truncated or corrupt.
  static Vocabulary from_bytes(std::string_view bytes, const std::string& where);
  /// Returns the vocabulary built into the library; takes one or two milliseconds.
  static Vocabulary built_in();

 private:
  std::uint32_t nearest_child(const Node& parent, const Descriptor& descriptor) const;
  std::uint32_t leaf(const Descriptor& descriptor) const;

  std::vector<Node> nodes_;
  std::vector<Descriptor> descriptors_;  // per node; that of the root is unused
  std::vector<float> idf_;               // per word
  int depth_ = 0;
};

}  // namespace stillmap
