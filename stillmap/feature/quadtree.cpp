// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/quadtree.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

constexpr int kDepth = 11;  // parts are split at most this often: to 1 / 2048 of the area's side

/// Moves the lower 16 bits apart, so that there is a free bit above each.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | (x << 8)) & 0x00ff00ffU;
  x = (x | (x << 4)) & 0x0f0f0f0fU;
  x = (x | (x << 2)) & 0x33333333U;
  return (x | (x << 1)) & 0x55555555U;
}

}  // namespace

const std::vector<Corner>& QuadtreeSpreader::spread(const std::vector<Corner>& corners,
                                                    const cv::Rect& area, int wanted) {
  kept_.clear();
  if (wanted <= 0) return kept_;
  if (corners.size() <= static_cast<std::size_t>(wanted)) return kept_ = corners;
  sort_along_curve(corners, area);
  split_until(wanted);
  keep_best(corners, wanted);
  return kept_;
}

void QuadtreeSpreader::sort_along_curve(const std::vector<Corner>& corners, const cv::Rect& area) {
  constexpr std::uint32_t kSide = 1U << kDepth;
  entries_.clear();
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t x = (corners[i].x - area.x) * kSide / area.width;
    const std::uint32_t y = (corners[i].y - area.y) * kSide / area.height;
    const std::uint64_t on_curve = spread_bits(x) | (spread_bits(y) << 1);
    entries_.push_back(on_curve << 32 | i);
  }
  std::sort(entries_.begin(), entries_.end());
}

void QuadtreeSpreader::split_until(std::size_t wanted) {
  nodes_.assign(1, {0, static_cast<std::uint32_t>(entries_.size()), kDepth});
  while (nodes_.size() < wanted) {
    order_.clear();
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].count() > 1 && nodes_[i].depth_left > 0) order_.push_back(i);
    }
    if (order_.empty()) return;
    if (nodes_.size() + 3 * order_.size() > wanted) {  // the last round: the fullest first
      std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return nodes_[a].count() > nodes_[b].count();
      });
    }
    for (const std::uint32_t i : order_) {
      split(i);
      if (nodes_.size() >= wanted) return;
    }
  }
}

/// Replaces a node by its quarters that hold corners.
void QuadtreeSpreader::split(std::size_t node) {
  Node rest = nodes_[node];
  --rest.depth_left;
  const int shift = 32 + 2 * rest.depth_left;
  bool first = true;
  while (rest.begin < rest.end) {
    const std::uint64_t next_quarter = ((entries_[rest.begin] >> shift) + 1) << shift;
    const auto end =
        std::lower_bound(entries_.begin() + rest.begin, entries_.begin() + rest.end, next_quarter);
    Node quarter = rest;
    quarter.end = rest.begin = static_cast<std::uint32_t>(end - entries_.begin());
    if (first)
      nodes_[node] = quarter;
    else
      nodes_.push_back(quarter);
    first = false;
  }
}

void QuadtreeSpreader::keep_best(const std::vector<Corner>& corners, std::size_t wanted) {
  const auto index_of = [](std::uint64_t entry) { return static_cast<std::uint32_t>(entry); };
  const auto stronger = [&](std::uint32_t a, std::uint32_t b) {
    return corners[a].score != corners[b].score ? corners[a].score > corners[b].score : a < b;
  };
  order_.clear();
  for (const Node& node : nodes_) {
    std::uint32_t best = index_of(entries_[node.begin]);
    for (std::uint32_t i = node.begin + 1; i < node.end; ++i) {
      if (stronger(index_of(entries_[i]), best)) best = index_of(entries_[i]);
    }
    order_.push_back(best);
  }
  if (order_.size() > wanted) {  // the last split may have given up to three too many
    std::nth_element(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(wanted),
                     order_.end(), stronger);
    order_.resize(wanted);
  }
  std::sort(order_.begin(), order_.end());
  for (const std::uint32_t i : order_) kept_.push_back(corners[i]);
}

}  // namespace stillmap
