// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_range.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

namespace stillmap {

/// A camera that delivers frames whether or not anybody takes them. One thread at a time.
class LiveCamera {
 public:
  virtual ~LiveCamera() = default;
  /// Returns the ideal pinhole camera of the frames.
  virtual const Camera& camera() const = 0;
  /// Waits a fraction of a second for the next frame, and returns null if none came. Throws Error
  /// if the camera cannot deliver any more frames.
  virtual std::shared_ptr<RgbdFrame> read() = 0;
  virtual std::vector<std::string> notes() const { return {}; }
  virtual std::vector<Finding> findings() const { return {}; }
};

/// The frames of a live camera. A thread reads the camera; if frames come faster than next() takes
/// them, the oldest ones are dropped. skipped() lists the dropped frames.
class LiveSource : public FrameSource {
 public:
  /// @param following  next() returns null when `stop` tells so, or when no frame has come for the
  ///                   time `patience`; the first frame may take as long
  /// @param range      frames of the camera, counted from the first one
  LiveSource(std::unique_ptr<LiveCamera> live, Following following, const FrameRange& range = {});
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;
  ~LiveSource() override;

  const Camera& camera() const override { return live_->camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return std::nullopt; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }
  std::vector<std::string> notes() const override { return live_->notes(); }
  std::vector<Finding> findings() const override { return live_->findings(); }

 private:
  void read_frames();
  void deliver(std::shared_ptr<RgbdFrame> frame);
  void list_dropped();

  std::unique_ptr<LiveCamera> live_;
  Following following_;
  FrameRange range_;
  std::vector<SkippedFrame> skipped_;  // of the thread that calls next()
  std::size_t next_index_ = 0;         // index of the next returned frame

  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<std::shared_ptr<RgbdFrame>> waiting_;
  std::vector<double> dropped_;  // times of the frames dropped since the last next() [s]
  std::string failure_;          // why the camera stopped; empty: it did not
  bool at_end_ = false;          // the camera delivers no more frames, or nobody wants them
  std::thread reader_;           // last: it uses all others
};

}  // namespace stillmap
