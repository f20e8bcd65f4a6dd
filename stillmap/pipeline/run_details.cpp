// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/run_details.hpp"

#include <algorithm>

namespace stillmap {

std::size_t RunDetails::frames_skipped() const {
  return static_cast<std::size_t>(
      std::count_if(skipped.begin(), skipped.end(), [](const auto& s) { return s.frame_lost; }));
}

std::vector<double> RunDetails::late_frames() const {
  std::vector<double> late = dropped;
  for (const SkippedFrame& s : skipped) {
    if (s.frame_lost && s.late) late.push_back(s.timestamp);
  }
  return late;
}

std::size_t frames_with(const SlamResult& result,
                        const std::function<bool(const FrameRecord&)>& property) {
  return static_cast<std::size_t>(
      std::count_if(result.frames.begin(), result.frames.end(), property));
}

}  // namespace stillmap
