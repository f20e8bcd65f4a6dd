// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/instance_stream.hpp"

#include "stillmap/base/stopwatch.hpp"

namespace stillmap {

InstanceStream::InstanceStream(std::unique_ptr<Detector> detector, const SlamOptions& options)
    : schedule_(options.schedule),
      detector_(std::move(detector)),
      wanted_classes_(MotionEstimator(options.motion).classes()),
      carrier_(options.carry) {
  if (!detector_) return;
  // In realtime the detector gets the newest frame whenever it is free, so one frame may wait.
  const bool realtime = schedule_.realtime();
  stage_ = std::make_unique<Stage<RgbdFramePtr, SegmentedFramePtr>>(
      realtime ? 1 : 8, realtime ? WhenFull::kDrop : WhenFull::kBlock,
      [this](const RgbdFramePtr& frame, const auto& publish) { publish(detect(frame)); });
}

SegmentedFramePtr InstanceStream::detect(const RgbdFramePtr& frame) {
  const Stopwatch watch;
  auto found = std::make_shared<SegmentedFrame>();
  found->frame_index = found->source_index = frame->index;
  // Only what a cue looks at is carried on: the rest costs time, and nobody asks for it.
  for (Instance& instance : detector_->detect(*frame)) {
    if (wanted_classes_.contains(instance.class_name)) {
      found->instances.push_back(std::move(instance));
    }
  }
  timing_.add("segmentation", watch.milliseconds());
  ++segmented_;
  return found;
}

void InstanceStream::push(const RgbdFramePtr& frame) {
  if (!detector_) return;
  newest_ = frame;
  carrier_.push(frame);
  if (frame->index % static_cast<std::size_t>(schedule_.segment_every) != 0 && any_) return;
  if (stage_->push(frame))
    due_.push_back(frame->index + static_cast<std::size_t>(schedule_.mask_delay));
}

void InstanceStream::collect() {
  if (!detector_) return;
  const auto take = [this](const std::optional<SegmentedFramePtr>& found) {
    if (!found) return false;
    carrier_.set(**found);
    due_.pop_front();
    any_ = true;
    return true;
  };
  if (!any_ && !due_.empty()) take(stage_->take());
  if (schedule_.realtime()) {
    while (take(stage_->try_take())) {
    }
  } else {
    while (!due_.empty() && due_.front() <= newest_->index) take(stage_->take());
  }
}

SegmentedFramePtr InstanceStream::current() const {
  return detector_ ? carrier_.current() : nullptr;
}

void InstanceStream::finish() {
  if (stage_) stage_->drain();
}

}  // namespace stillmap
