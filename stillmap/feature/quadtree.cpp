// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/quadtree.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace stillmap {
namespace {

constexpr int kDepth = 11;  // Maximum number of divisions: to 1 / 2048 of the side of the area.

/// Spreads the lower 16 bits so that there is a free bit above each.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | (x << 8)) & 0x00ff00ffU;
  x = (x | (x << 4)) & 0x0f0f0f0fU;
  x = (x | (x << 2)) & 0x33333333U;
  return (x | (x << 1)) & 0x55555555U;
}

}  // namespace

const std::vector<Corner>& QuadtreeSpreader::spread(const std::vector<Corner>& corners,
                                                    const cv::Rect& area, int wanted) {
  const TraceScope scope("quadtree");
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
    entries_.push_back({spread_bits(x) | (spread_bits(y) << 1), i});
  }
  sort_by_digit(0);
  sort_by_digit(kDepth);
}

/// One pass of a stable radix sort by the kDepth bits from `shift` on.
void QuadtreeSpreader::sort_by_digit(int shift) {
  constexpr std::uint32_t kDigits = 1U << kDepth;
  std::array<std::uint32_t, kDigits + 1> begin{};
  const auto digit = [shift](const Entry& e) { return (e.place >> shift) & (kDigits - 1); };
  for (const Entry& e : entries_) ++begin[digit(e) + 1];
  for (std::uint32_t d = 0; d < kDigits; ++d) begin[d + 1] += begin[d];
  sorted_.resize(entries_.size());
  for (const Entry& e : entries_) sorted_[begin[digit(e)]++] = e;
  entries_.swap(sorted_);
}

void QuadtreeSpreader::split_until(std::size_t wanted) {
  nodes_.assign(1, {0, static_cast<std::uint32_t>(entries_.size()), kDepth});
  while (nodes_.size() < wanted) {
    order_.clear();
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].count() > 1 && nodes_[i].depth_left > 0) order_.push_back(i);
    }
    if (order_.empty()) return;
    // The last round starts with the fullest parts.
    if (nodes_.size() + 3 * order_.size() > wanted) {
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

/// Replaces a node by its quarters that contain corners.
void QuadtreeSpreader::split(std::size_t node) {
  Node rest = nodes_[node];
  --rest.depth_left;
  const int shift = 2 * rest.depth_left;
  bool first = true;
  while (rest.begin < rest.end) {
    const std::uint32_t next_quarter = ((entries_[rest.begin].place >> shift) + 1) << shift;
    const auto end =
        std::partition_point(entries_.begin() + rest.begin, entries_.begin() + rest.end,
                             [&](const Entry& e) { return e.place < next_quarter; });
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
  const auto stronger = [&](std::uint32_t a, std::uint32_t b) {
    return corners[a].score != corners[b].score ? corners[a].score > corners[b].score : a < b;
  };
  order_.clear();
  for (const Node& node : nodes_) {
    std::uint32_t best = entries_[node.begin].corner;
    for (std::uint32_t i = node.begin + 1; i < node.end; ++i) {
      if (stronger(entries_[i].corner, best)) best = entries_[i].corner;
    }
    order_.push_back(best);
  }
  if (order_.size() > wanted) {  // The last division may give up to three too many.
    std::nth_element(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(wanted),
                     order_.end(), stronger);
    order_.resize(wanted);
  }
  std::sort(order_.begin(), order_.end());
  for (const std::uint32_t i : order_) kept_.push_back(corners[i]);
}

}  // namespace stillmap
