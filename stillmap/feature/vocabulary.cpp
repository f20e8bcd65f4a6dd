// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/vocabulary.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/feature/matching.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace stillmap {
namespace {

Error no_tree() {
  return {"the parts of the vocabulary do not form one tree", "vocabulary", "train it again"};
}

/// Returns the nodes with consecutive children, in level order.
std::vector<Vocabulary::Node> link_nodes(const std::vector<std::uint8_t>& children) {
  std::vector<Vocabulary::Node> nodes(children.size());
  std::uint32_t next = 1, word = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i >= next) throw no_tree();  // A node without parent.
    nodes[i].first_child = next;
    nodes[i].children = children[i];
    if (children[i] == 0) nodes[i].word = word++;
    next += children[i];
  }
  if (next != nodes.size()) throw no_tree();
  return nodes;
}

int depth_of(const std::vector<Vocabulary::Node>& nodes) {
  int depth = 0;
  std::vector<int> level(nodes.size(), 0);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (std::uint32_t c = 0; c < nodes[i].children; ++c) {
      level[nodes[i].first_child + c] = level[i] + 1;
      depth = std::max(depth, level[i] + 1);
    }
  }
  return depth;
}

/// Returns the words and their counts, sorted by word.
BowVector count_words(std::vector<std::uint32_t> words) {
  std::sort(words.begin(), words.end());
  BowVector counts;
  for (const std::uint32_t word : words) {
    if (counts.empty() || counts.back().word != word) counts.push_back({word, 0});
    counts.back().weight += 1;
  }
  return counts;
}

}  // namespace

double similarity(const BowVector& a, const BowVector& b) {
  double sum = 0;
  auto i = a.begin(), j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (i->word == j->word) {
      sum += std::min(i->weight, j->weight);
      ++i, ++j;
    } else if (i->word < j->word) {
      ++i;
    } else {
      ++j;
    }
  }
  return sum;
}

Vocabulary::Vocabulary(std::vector<std::uint8_t> children, std::vector<Descriptor> descriptors,
                       std::vector<float> idf)
    : nodes_(link_nodes(children)), descriptors_(std::move(descriptors)), idf_(std::move(idf)) {
  const auto leaves = static_cast<std::size_t>(std::count(children.begin(), children.end(), 0));
  const auto possible = [](float x) {
    return x >= 0 && x < std::numeric_limits<float>::infinity();
  };
  if (nodes_.size() < 2 || descriptors_.size() + 1 != nodes_.size() || idf_.size() != leaves ||
      !std::all_of(idf_.begin(), idf_.end(), possible)) {
    throw no_tree();
  }
  descriptors_.insert(descriptors_.begin(), Descriptor{});
  depth_ = depth_of(nodes_);
}

std::uint32_t Vocabulary::nearest_child(const Node& parent, const Descriptor& descriptor) const {
  const std::span all(descriptors_);
  return parent.first_child +
         nearest_two(descriptor, all.subspan(parent.first_child, parent.children)).best;
}

std::uint32_t Vocabulary::leaf(const Descriptor& descriptor) const {
  return node(descriptor, depth_);
}

std::uint32_t Vocabulary::node(const Descriptor& descriptor, int level) const {
  std::uint32_t at = 0;
  for (int i = 0; i < level && nodes_[at].children > 0; ++i)
    at = nearest_child(nodes_[at], descriptor);
  return at;
}

BagOfWords Vocabulary::transform(std::span<const Descriptor> descriptors,
                                 std::span<const float> weights, int direct_level) const {
  BagOfWords bag;
  std::vector<std::uint32_t> words;
  for (std::uint32_t i = 0; i < descriptors.size(); ++i) {
    if (!weights.empty() && weights[i] <= 0) continue;
    std::uint32_t at = 0, direct = 0;
    for (int level = 1; nodes_[at].children > 0; ++level) {
      at = nearest_child(nodes_[at], descriptors[i]);
      if (level <= direct_level) direct = at;
    }
    words.push_back(nodes_[at].word);
    bag.nodes.push_back({direct, i});
  }
  std::sort(bag.nodes.begin(), bag.nodes.end());
  bag.words = count_words(std::move(words));
  double sum = 0;
  for (WordWeight& w : bag.words) sum += w.weight *= idf_[w.word];
  std::erase_if(bag.words, [](const WordWeight& w) { return w.weight <= 0; });
  for (WordWeight& w : bag.words) w.weight = static_cast<float>(w.weight / sum);
  return bag;
}

}  // namespace stillmap
