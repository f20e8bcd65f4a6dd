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

/// A word of an image's bag, and how much it says about the image.
struct WordWeight {
  std::uint32_t word = 0;
  float weight = 0;  ///< > 0
  bool operator==(const WordWeight&) const = default;
};

/// An image as the words that occur in it, sorted by word; the weights add up to 1. Empty for an
/// image without any keypoint that counts.
using BowVector = std::vector<WordWeight>;

/// How alike two images are, 0 to 1: 1 - |a - b| / 2 in the L1 norm (Galvez-Lopez and Tardos, Bags
/// of Binary Words, TRO 2012, eq. 2), which for vectors that add up to 1 is sum min(a_i, b_i).
double similarity(const BowVector& a, const BowVector& b);

/// Keypoint `keypoint` falls into node `node` of the vocabulary tree.
struct NodeKeypoint {
  std::uint32_t node = 0, keypoint = 0;
  auto operator<=>(const NodeKeypoint&) const = default;
};

/// What the vocabulary makes of an image.
struct BagOfWords {
  BowVector words;
  /// Direct index: the keypoints that count, by node of one level, then by keypoint. Keypoints of
  /// two images that show one thing mostly fall into one node, so matches are sought there.
  std::vector<NodeKeypoint> nodes;
};

/// Which level of the tree the direct index is about: level 2 has about branching^2 nodes. Chosen
/// by measurement, see vocabulary_test.cpp and docs/results.md.
inline constexpr int kDirectIndexLevel = 2;

/// A tree of binary descriptors (Nister and Stewenius, Scalable Recognition with a Vocabulary Tree,
/// CVPR 2006): from the root a descriptor goes to the nearest child until it reaches a leaf, its
/// word. Words are weighted by TF-IDF (Sivic and Zisserman, Video Google, ICCV 2003). Immutable;
/// may be used by several threads at once.
class Vocabulary {
 public:
  /// One node, in the order of levels; children of a node lie side by side.
  struct Node {
    std::uint32_t first_child = 0;
    std::uint32_t children = 0;  ///< 0: a leaf
    std::uint32_t word = 0;      ///< of a leaf: 0, 1, 2 ... in the order of nodes
  };

  /// From the numbers of children of all nodes, level by level, the root first.
  /// @param descriptors  one per node but the root, in the same order
  /// @param idf          one per leaf, in their order: ln(images / images with the word), >= 0
  /// Throws Error if they do not make one tree.
  Vocabulary(std::vector<std::uint8_t> children, std::vector<Descriptor> descriptors,
             std::vector<float> idf);

  std::size_t words() const { return idf_.size(); }
  std::size_t nodes() const { return nodes_.size(); }
  int depth() const { return depth_; }  ///< levels below the root
  float idf(std::uint32_t word) const { return idf_[word]; }

  /// The word of a descriptor. Equally near children: the first.
  std::uint32_t word(const Descriptor& descriptor) const { return nodes_[leaf(descriptor)].word; }
  /// The node on the way to its word that lies `level` steps below the root, or the leaf if that
  /// comes first.
  std::uint32_t node(const Descriptor& descriptor, int level) const;

  /// The image's words, TF-IDF weighted, L1-normalized, and its direct index.
  /// @param weights  one per descriptor: those of weight 0 or less are left out; empty: all count
  BagOfWords transform(std::span<const Descriptor> descriptors, std::span<const float> weights = {},
                       int direct_level = kDirectIndexLevel) const;

  /// The file format, described in vocabulary_file.cpp. Equal vocabularies, equal bytes.
  std::string bytes() const;
  /// @param where  names the source in errors
  /// Throws Error if the bytes are no vocabulary, of a newer version, cut short or altered.
  static Vocabulary from_bytes(std::string_view bytes, const std::string& where);
  /// The one that is built into the library; a millisecond or two.
  static Vocabulary built_in();

 private:
  std::uint32_t nearest_child(const Node& parent, const Descriptor& descriptor) const;
  std::uint32_t leaf(const Descriptor& descriptor) const;

  std::vector<Node> nodes_;
  std::vector<Descriptor> descriptors_;  // per node; the root's means nothing
  std::vector<float> idf_;               // per word
  int depth_ = 0;
};

}  // namespace stillmap
