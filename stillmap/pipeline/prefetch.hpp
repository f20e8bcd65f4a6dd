// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <memory>

namespace stillmap {

/// Reads and decodes ahead in a thread of its own: a source around another source.
class Prefetch final : public FrameSource {
 public:
  /// @param ahead    frames decoded before they are asked for, at most
  /// @param priority of the reading thread: kNone where the source plays a camera, whose frames do
  ///                 not wait for the network
  Prefetch(std::unique_ptr<FrameSource> source, int ahead = 4,
           ThreadPriority priority = ThreadPriority::kBackground);

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return size_; }
  /// Complete once next() has yielded null.
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
