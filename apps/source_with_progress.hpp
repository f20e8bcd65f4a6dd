// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "progress.hpp"
#include <fmt/format.h>

namespace stillmap {

/// A source that shows how many frames were read. A pass may end before the last frame.
class SourceWithProgress final : public FrameSource {
 public:
  SourceWithProgress(std::unique_ptr<FrameSource> source, int pass)
      : source_(std::move(source)), progress_(fmt::format("pass {}", pass), source_->size()) {}
  ~SourceWithProgress() override { progress_.complete(); }
  SourceWithProgress(const SourceWithProgress&) = delete;
  SourceWithProgress& operator=(const SourceWithProgress&) = delete;

  const Camera& camera() const override { return source_->camera(); }
  RgbdFramePtr next() override {
    RgbdFramePtr frame = source_->next();
    if (frame) progress_.step();
    return frame;
  }
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }
  std::vector<std::string> notes() const override { return source_->notes(); }
  std::vector<Finding> findings() const override { return source_->findings(); }

 private:
  std::unique_ptr<FrameSource> source_;
  Progress progress_;
};

}  // namespace stillmap
