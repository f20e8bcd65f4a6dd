// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/vocabulary_training.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/feature/matching.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

namespace stillmap {
namespace {

using Group = std::vector<Descriptor>;

void check(const VocabularyTrainingOptions& options) {
  const auto within = [](int value, int low, int high) { return value >= low && value <= high; };
  if (!within(options.branching, 2, 255)) {
    throw Error("the branching must be 2 to 255", "vocabulary", "use about 10");
  }
  if (!within(options.depth, 1, 12) || options.iterations < 1) {
    throw Error("the depth must be 1 to 12 and iterations positive", "vocabulary",
                "use a depth of about 4");
  }
}

/// Computes the center of a cluster: the majority of each bit.
class BitMajority {
 public:
  void add(const Descriptor& d) {
    ++count_;
    for (std::size_t w = 0; w < 4; ++w) {
      for (std::size_t b = 0; b < 64; ++b) {
        ones_[64 * w + b] += static_cast<std::uint32_t>((d[w] >> b) & 1);
      }
    }
  }
  bool empty() const { return count_ == 0; }
  Descriptor center() const {
    Descriptor d{};
    for (std::size_t i = 0; i < 256; ++i) {
      if (2 * ones_[i] > count_) d[i / 64] |= std::uint64_t{1} << (i % 64);
    }
    return d;
  }

 private:
  std::array<std::uint32_t, 256> ones_{};
  std::uint32_t count_ = 0;
};

/// Returns initial centers: each next one is drawn with a probability proportional to its squared
/// distance to the previous ones. Fewer than wanted if the group has fewer different descriptors.
Group first_centers(const Group& group, std::size_t wanted, std::mt19937_64& random) {
  Group centers;
  centers.push_back(group[random() % group.size()]);
  std::vector<std::uint64_t> squared(group.size(), 257 * 257);
  while (centers.size() < wanted) {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto d = static_cast<std::uint64_t>(distance(group[i], centers.back()));
      squared[i] = std::min(squared[i], d * d);
      sum += squared[i];
    }
    if (sum == 0) break;
    std::uint64_t left = random() % sum;
    std::size_t chosen = 0;
    while (left >= squared[chosen]) left -= squared[chosen++];
    centers.push_back(group[chosen]);
  }
  return centers;
}

std::vector<std::uint32_t> assign(const Group& group, const Group& centers) {
  std::vector<std::uint32_t> nearest(group.size());
  for (std::size_t i = 0; i < group.size(); ++i)
    nearest[i] = nearest_two(group[i], std::span<const Descriptor>(centers)).best;
  return nearest;
}

/// Returns the centers moved to the centers of their nearest descriptors, without those that have
/// none.
Group moved_centers(const Group& group, const std::vector<std::uint32_t>& nearest,
                    std::size_t count) {
  std::vector<BitMajority> majority(count);
  for (std::size_t i = 0; i < group.size(); ++i) majority[nearest[i]].add(group[i]);
  Group centers;
  for (const BitMajority& m : majority) {
    if (!m.empty()) centers.push_back(m.center());
  }
  return centers;
}

/// A group divided into clusters around centers.
struct Clusters {
  Group centers;
  std::vector<Group> groups;  ///< One per center, none empty.
};

Clusters cluster(const Group& group, const VocabularyTrainingOptions& options,
                 std::mt19937_64& random) {
  Group centers = first_centers(group, static_cast<std::size_t>(options.branching), random);
  auto nearest = assign(group, centers);
  for (int i = 0; i < options.iterations; ++i) {
    Group moved = moved_centers(group, nearest, centers.size());
    if (moved == centers) break;
    centers = std::move(moved);
    nearest = assign(group, centers);
  }
  std::vector<Group> groups(centers.size());
  for (std::size_t i = 0; i < group.size(); ++i) groups[nearest[i]].push_back(group[i]);
  Clusters clusters;
  for (std::size_t c = 0; c < centers.size(); ++c) {
    if (groups[c].empty()) continue;
    clusters.centers.push_back(centers[c]);
    clusters.groups.push_back(std::move(groups[c]));
  }
  return clusters;
}

/// The tree in the format of Vocabulary.
struct Tree {
  std::vector<std::uint8_t> children;
  std::vector<Descriptor> descriptors;
};

/// Grows level by level, so that nodes are in level order.
Tree grow(Group all, const VocabularyTrainingOptions& options) {
  std::mt19937_64 random(static_cast<std::uint64_t>(options.seed));
  Tree tree;
  std::vector<Group> level;
  level.push_back(std::move(all));
  for (int depth = 0; !level.empty(); ++depth) {
    std::vector<Group> next;
    for (Group& group : level) {
      Clusters clusters;
      if (depth < options.depth) clusters = cluster(group, options, random);
      if (clusters.centers.size() < 2) clusters = {};
      tree.children.push_back(static_cast<std::uint8_t>(clusters.centers.size()));
      tree.descriptors.insert(tree.descriptors.end(), clusters.centers.begin(),
                              clusters.centers.end());
      std::move(clusters.groups.begin(), clusters.groups.end(), std::back_inserter(next));
      group = {};  // Frees memory for the next level.
    }
    level = std::move(next);
  }
  return tree;
}

/// Returns ln(images / images with the word) for all words.
std::vector<float> inverse_document_frequencies(const Vocabulary& vocabulary,
                                                std::span<const std::vector<Descriptor>> images) {
  struct Count {
    int images = 0;
    /// Last image in which it was counted.
    std::size_t last = std::numeric_limits<std::size_t>::max();
  };
  std::vector<Count> counts(vocabulary.words());
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (const Descriptor& d : images[i]) {
      Count& count = counts[vocabulary.word(d)];
      if (std::exchange(count.last, i) != i) ++count.images;
    }
  }
  // A word that its own descriptors miss on the path from the root counts as seen once.
  std::vector<float> idf;
  for (const Count& c : counts)
    idf.push_back(
        static_cast<float>(std::log(static_cast<double>(images.size()) / std::max(c.images, 1))));
  return idf;
}

}  // namespace

Vocabulary train_vocabulary(std::span<const std::vector<Descriptor>> images,
                            const VocabularyTrainingOptions& options) {
  check(options);
  Group all;
  for (const auto& image : images) all.insert(all.end(), image.begin(), image.end());
  if (all.empty() ||
      std::count(all.begin(), all.end(), all.front()) == static_cast<std::ptrdiff_t>(all.size())) {
    throw Error("there are fewer than two different descriptors to train with", "vocabulary",
                "give images with texture");
  }
  Tree tree = grow(std::move(all), options);
  const auto leaves = std::count(tree.children.begin(), tree.children.end(), 0);
  const Vocabulary unweighted(tree.children, tree.descriptors,
                              std::vector<float>(static_cast<std::size_t>(leaves), 1.0F));
  return {tree.children, tree.descriptors, inverse_document_frequencies(unweighted, images)};
}

}  // namespace stillmap
