// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/paced_source.hpp"

#include <cmath>
#include <thread>
#include <utility>

namespace stillmap {

TimelySource::TimelySource(std::unique_ptr<FrameSource> source, double slower, Seconds now)
    : source_(std::move(source)), slower_(slower), now_(std::move(now)) {}

double TimelySource::steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

RgbdFramePtr TimelySource::next() {
  const double began = now_();
  if (start_) {
    const double read = (began + reading_ - *start_) / slower_;  // since the first stamp
    source_->skip_before(first_stamp_ + read - 1 / camera().fps);
  }
  RgbdFramePtr frame = source_->next();
  const double ended = now_();
  reading_ = ended - began;
  if (frame && !start_) {
    start_ = ended;
    first_stamp_ = frame->timestamp;
  }
  return frame;
}

/// Adds the frames between the newest one and this one to the dropped frames.
void PacedSource::list_left_out(const RgbdFrame& frame) {
  if (newest_) {
    for (std::size_t i = *newest_ + 1; i < frame.index; ++i) {
      const double share =
          static_cast<double>(i - *newest_) / static_cast<double>(frame.index - *newest_);
      dropped_.push_back(std::lerp(newest_stamp_, frame.timestamp, share));
    }
  }
  newest_ = frame.index;
  newest_stamp_ = frame.timestamp;
}

RgbdFramePtr PacedSource::next() {
  while (RgbdFramePtr frame = source_->next()) {
    list_left_out(*frame);
    if (!start_) {
      start_ = Clock::now();
      first_stamp_ = frame->timestamp;
    }
    const auto since_start =
        std::chrono::duration<double>(slower_ * (frame->timestamp - first_stamp_));
    const auto due = *start_ + std::chrono::duration_cast<Clock::duration>(since_start);
    const auto interval = std::chrono::duration<double>(slower_ / camera().fps);
    if (Clock::now() > due + interval) {
      dropped_.push_back(frame->timestamp);
      continue;
    }
    std::this_thread::sleep_until(due);
    return frame;
  }
  return nullptr;
}

}  // namespace stillmap
