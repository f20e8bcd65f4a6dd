// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/paced_source.hpp"

#include <thread>

namespace stillmap {

RgbdFramePtr PacedSource::next() {
  while (RgbdFramePtr frame = source_->next()) {
    if (!start_) {
      start_ = Clock::now();
      first_stamp_ = frame->timestamp;
    }
    const auto since_start =
        std::chrono::duration<double>(slower_ * (frame->timestamp - first_stamp_));
    const auto due = *start_ + std::chrono::duration_cast<Clock::duration>(since_start);
    const auto interval = std::chrono::duration<double>(slower_ / camera().fps);
    if (Clock::now() > due + interval) {
      ++dropped_;
      continue;
    }
    std::this_thread::sleep_until(due);
    return frame;
  }
  return nullptr;
}

}  // namespace stillmap
