// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <memory>

namespace stillmap {

/// Source that reads and decodes the frames of another source in advance, on its own thread.
class Prefetch final : public FrameSource {
 public:
  /// @param ahead    largest number of frames decoded in advance
  /// @param priority priority of the reading thread: kNone for a source that replays a camera
  Prefetch(std::unique_ptr<FrameSource> source, int ahead = 4,
           ThreadPriority priority = ThreadPriority::kMap);

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return size_; }
  /// Returns the skipped frames. The list is complete once next() has returned null.
  const std::vector<SkippedFrame>& skipped() const override;

 private:
  struct Request {};
  std::unique_ptr<FrameSource> source_;
  Camera camera_;
  std::optional<std::size_t> size_;
  std::vector<SkippedFrame> none_yet_;
  bool at_end_ = false;
  std::unique_ptr<Stage<Request, RgbdFramePtr>> stage_;  // last: its thread uses source_
};

}  // namespace stillmap
