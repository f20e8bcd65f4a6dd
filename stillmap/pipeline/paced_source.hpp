// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// Source that reads a recording for a PacedSource, on the reading thread. Frames that would be too
/// late when they are read are left out before: if reading takes longer than the time between two
/// frames, as stereo matching may, it would fall behind more and more, and every frame be late.
class TimelySource final : public FrameSource {
 public:
  using Seconds = std::function<double()>;
  /// @param slower  as of PacedSource
  /// @param now     a clock [s]
  explicit TimelySource(std::unique_ptr<FrameSource> source, double slower = 1,
                        Seconds now = steady_seconds);

  const Camera& camera() const override { return source_->camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }

 private:
  static double steady_seconds();

  std::unique_ptr<FrameSource> source_;
  const double slower_;
  const Seconds now_;
  std::optional<double> start_;  // when the first frame was read [s]
  double first_stamp_ = 0;
  double reading_ = 0;  // how long reading took the last time [s]
};

/// Source that replays a recording at its original rate. next() waits until the frame is due; a
/// frame that is requested more than one frame interval late is dropped and listed, as a live
/// camera would drop it. Frames that a TimelySource left out are listed as well.
class PacedSource final : public FrameSource {
 public:
  /// @param slower  factor on the time between frames, for programs slowed by a sanitizer
  explicit PacedSource(std::unique_ptr<FrameSource> source, double slower = 1)
      : source_(std::move(source)), slower_(slower) {}

  const Camera& camera() const override { return source_->camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }
  /// Returns the timestamps of the dropped frames [s]. They are interpolated for frames that a
  /// TimelySource left out.
  const std::vector<double>& dropped() const { return dropped_; }

 private:
  using Clock = std::chrono::steady_clock;
  void list_left_out(const RgbdFrame& frame);

  std::unique_ptr<FrameSource> source_;
  const double slower_;
  std::optional<Clock::time_point> start_;
  double first_stamp_ = 0;
  std::vector<double> dropped_;
  std::optional<std::size_t> newest_;  // index of the newest frame
  double newest_stamp_ = 0;            // [s]
};

}  // namespace stillmap
