// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace stillmap {

/// Maximum time difference of a color and a depth image [s], exclusive: the rule of the TUM
/// benchmark.
inline constexpr double kMaxPairDifference = 0.02;

/// Maximum time difference of two images of a stereo pair [s], exclusive: a camera that turns by
/// 1 rad/s turns by 2 mrad, which is a pixel at a focal length of 500 pixels.
inline constexpr double kMaxStereoDifference = 0.002;

/// Returns the longest strictly increasing subsequence (Fredman 1975, by patience sorting), as one
/// flag per timestamp.
std::vector<bool> longest_increasing(const std::vector<double>& stamps);

/// Keeps the items with strictly increasing timestamps and lists the dropped ones.
/// @param what  the list of items, for the reason
template <typename Item>
void keep_increasing(std::vector<Item>& items, std::vector<SkippedFrame>& skipped,
                     const std::string& what) {
  std::vector<double> stamps;
  for (const Item& item : items) stamps.push_back(item.timestamp);
  const std::vector<bool> kept = longest_increasing(stamps);
  const std::set<double> kept_stamps = [&] {
    std::set<double> set;
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      if (kept[i]) set.insert(stamps[i]);
    }
    return set;
  }();
  std::vector<Item> increasing;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (kept[i]) {
      increasing.push_back(items[i]);
      continue;
    }
    const char* problem = kept_stamps.count(stamps[i]) ? "repeats" : "is out of order";
    skipped.push_back(
        {stamps[i], fmt::format("{}: the timestamp {:.6f} {}", what, stamps[i], problem)});
  }
  items = std::move(increasing);
}

}  // namespace stillmap
