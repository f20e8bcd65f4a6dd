// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/fast.hpp"

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Picks corners that are strong and spread evenly: the area is split into quarters, round by
/// round, each part that holds more than one corner, until there are as many parts with corners as
/// corners wanted (in the last round the fullest parts first); then the strongest corner of each
/// part is kept.
///
/// The corners are sorted along a Morton (Z) curve, on which each part of the tree is one
/// contiguous range; splitting a part is three binary searches.
class QuadtreeSpreader {
 public:
  /// At most `wanted` of `corners`, in their order; all if there are no more. `area` holds them
  /// all. Of equally strong ones the first is kept. Valid until the next call.
  const std::vector<Corner>& spread(const std::vector<Corner>& corners, const cv::Rect& area,
                                    int wanted);

 private:
  struct Entry {
    std::uint32_t place;  // on the curve
    std::uint32_t corner;
  };
  /// A part of the area: entries_[begin, end), whose places differ in the last 2 * depth_left bits
  /// alone.
  struct Node {
    std::uint32_t begin, end;
    int depth_left;
    std::uint32_t count() const { return end - begin; }
  };
  void sort_along_curve(const std::vector<Corner>& corners, const cv::Rect& area);
  void sort_by_digit(int shift);
  void split_until(std::size_t wanted);
  void split(std::size_t node);
  void keep_best(const std::vector<Corner>& corners, std::size_t wanted);

  std::vector<Entry> entries_, sorted_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  std::vector<Corner> kept_;
};

}  // namespace stillmap
