// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/prefetch.hpp"

namespace stillmap {

Prefetch::Prefetch(std::unique_ptr<FrameSource> source, int ahead, ThreadPriority priority)
    : source_(std::move(source)), camera_(source_->camera()), size_(source_->size()) {
  stage_ = std::make_unique<Stage<Request, RgbdFramePtr>>(
      static_cast<std::size_t>(ahead), WhenFull::kBlock,
      [this](Request, const auto& publish) { publish(source_->next()); }, "reading", priority);
  for (int i = 0; i < ahead; ++i) stage_->push({});
}

RgbdFramePtr Prefetch::next() {
  if (at_end_) return nullptr;
  RgbdFramePtr frame = stage_->pop().value();
  if (frame) {
    stage_->push({});
  } else {
    at_end_ = true;
    stage_->drain();  // no other thread uses the source from now on, so skipped() can be read
  }
  return frame;
}

const std::vector<SkippedFrame>& Prefetch::skipped() const {
  return at_end_ ? source_->skipped() : none_yet_;
}

}  // namespace stillmap
