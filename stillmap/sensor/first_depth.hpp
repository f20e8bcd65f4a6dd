// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/counted.hpp"
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/sensor/increasing.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace stillmap {

/// Skips the frames before the first one with depth, since no map can start without depth.
/// @param has_depth whether a frame has a depth image
/// @param name_of   name of the color image of a frame, for the reason
template <typename Frame, typename HasDepth, typename NameOf>
void skip_before_first_depth(std::vector<Frame>& frames, const HasDepth& has_depth,
                             const NameOf& name_of, std::vector<SkippedFrame>& skipped) {
  const auto first = std::find_if(frames.begin(), frames.end(), has_depth);
  for (auto frame = frames.begin(); frame != first; ++frame) {
    skipped.push_back({.timestamp = frame->timestamp,
                       .reason = fmt::format("{}: no depth image within {} s, and none before",
                                             name_of(*frame), kMaxPairDifference)});
  }
  frames.erase(frames.begin(), first);
}

/// Returns the sentence that some color images have no depth image; empty if all have one.
template <typename Frame, typename HasDepth>
std::string without_depth_note(const std::vector<Frame>& frames, const HasDepth& has_depth) {
  const auto without = std::count_if(frames.begin(), frames.end(),
                                     [&](const Frame& frame) { return !has_depth(frame); });
  if (without == 0) return "";
  return fmt::format("{} of {} color images {} no depth image within {} s", without, frames.size(),
                     have(without), kMaxPairDifference);
}

}  // namespace stillmap
