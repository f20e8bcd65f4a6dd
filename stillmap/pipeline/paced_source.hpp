// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <chrono>
#include <memory>

namespace stillmap {

/// Source that replays a recording at its original rate. next() waits until the frame is due; a
/// frame that is requested more than one frame interval late is dropped and counted, as a live
/// camera would drop it.
class PacedSource final : public FrameSource {
 public:
  /// @param slower  factor on the time between frames, for programs slowed by a sanitizer
  explicit PacedSource(std::unique_ptr<FrameSource> source, double slower = 1)
      : source_(std::move(source)), slower_(slower) {}

  const Camera& camera() const override { return source_->camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }
  std::size_t dropped() const { return dropped_; }

 private:
  using Clock = std::chrono::steady_clock;
  std::unique_ptr<FrameSource> source_;
  const double slower_;
  std::optional<Clock::time_point> start_;
  double first_stamp_ = 0;
  std::size_t dropped_ = 0;
};

}  // namespace stillmap
