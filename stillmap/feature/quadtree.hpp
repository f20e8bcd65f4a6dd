// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/fast.hpp"

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Selects strong and evenly distributed corners: the area is divided into quarters repeatedly,
/// each part with more than one corner, until the number of parts with corners equals the wanted
/// number (in the last round the fullest parts first); then the strongest corner of each part is
/// kept.
///
/// Corners are sorted along a Morton (Z) curve, on which each part of the tree is a contiguous
/// range; dividing a part takes three binary searches.
class QuadtreeSpreader {
 public:
  /// Returns at most `wanted` of `corners`, in their order. `area` must contain all of them. The
  /// first of equally strong corners is kept. Valid until the next call.
  const std::vector<Corner>& spread(const std::vector<Corner>& corners, const cv::Rect& area,
                                    int wanted);

 private:
  struct Entry {
    std::uint32_t place;  // position on the curve
    std::uint32_t corner;
  };
  /// A part of the area: entries_[begin, end), whose positions differ in the last 2 * depth_left
  /// bits only.
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
