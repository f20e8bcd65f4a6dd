// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace stillmap {

/// Part of the frames of a recording.
struct FrameRange {
  int first = 0;   ///< Number of frames skipped at the start.
  int count = 0;   ///< Maximum number of frames, counted before the stride; 0: all.
  int stride = 1;  ///< Every n-th frame is used.
};

/// Throws Error for a negative first or count, and a stride below 1.
inline void check_range(const FrameRange& range) {
  const auto expect = [](bool holds, const char* key, const char* fix) {
    if (!holds) throw Error("is out of range", key, fix);
  };
  expect(range.first >= 0, "first", "give the number of frames to leave out: 0 or more");
  expect(range.count >= 0, "count", "give the number of frames to use, 0 for all");
  expect(range.stride >= 1, "stride", "give 1 for every frame, 2 for every second ...");
}

/// Keeps the frames of the range, and of the skipped lines those between them.
/// @param where  the recording, for messages
/// Throws Error if no frame is in the range.
template <typename Frame>
void keep_range(const FrameRange& range, const std::string& where, std::vector<Frame>& frames,
                std::vector<SkippedFrame>& skipped) {
  const auto total = frames.size();
  const auto first = static_cast<std::size_t>(range.first);
  if (first >= total) {
    throw Error(fmt::format("the sequence has {}, and the first one wanted is {}",
                            counted(total, "frame"), first),
                where, "start earlier");
  }
  const auto wanted = range.count > 0 ? static_cast<std::size_t>(range.count) : total;
  const auto end = first + std::min(wanted, total - first);
  std::vector<Frame> chosen;
  for (auto i = first; i < end; i += static_cast<std::size_t>(range.stride))
    chosen.push_back(std::move(frames[i]));
  frames = std::move(chosen);
  if (end - first == total) return;
  std::erase_if(skipped, [&](const SkippedFrame& line) {
    return line.timestamp < frames.front().timestamp || line.timestamp > frames.back().timestamp;
  });
}

/// Returns the number of frames from a position on that are before a time; the last frame is not
/// one of them.
template <typename Frame>
std::size_t count_before(double timestamp, const std::vector<Frame>& frames, std::size_t position) {
  std::size_t end = position;
  while (end + 1 < frames.size() && frames[end].timestamp < timestamp) ++end;
  return end - position;
}

}  // namespace stillmap
