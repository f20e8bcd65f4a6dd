// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/instance_stream.hpp"

#include "stillmap/base/stopwatch.hpp"

namespace stillmap {
namespace {

/// What the cues look at, and what the dense map keeps out.
std::set<std::string> wanted_classes(const SlamOptions& options) {
  std::set<std::string> classes = MotionEstimator(options.motion).classes();
  if (options.dense_cloud) classes.insert(options.dense.movers.begin(), options.dense.movers.end());
  return classes;
}

}  // namespace

InstanceStream::InstanceStream(std::unique_ptr<Detector> detector, const SlamOptions& options)
    : schedule_(options.schedule),
      detector_(std::move(detector)),
      wanted_classes_(wanted_classes(options)),
      carrier_(options.carry) {
  if (!detector_) return;
  // In realtime the detector gets the newest frame whenever it is free, so one frame may wait.
  const bool realtime = schedule_.realtime();
  stage_ = std::make_unique<Stage<RgbdFramePtr, FoundThings>>(
      realtime ? 1 : 8, realtime ? WhenFull::kDrop : WhenFull::kBlock,
      [this](const RgbdFramePtr& frame, const auto& publish) { publish(detect(frame)); });
}

FoundThings InstanceStream::detect(const RgbdFramePtr& frame) {
  const Stopwatch watch;
  auto found = std::make_shared<SegmentedFrame>();
  found->frame_index = found->source_index = frame->index;
  found->instances = detector_->detect(*frame);
  timing_.add("segmentation", watch.milliseconds());
  ++segmented_;
  return {frame, found};
}

/// Only what a cue or the dense map asks for is carried on: the rest costs time.
SegmentedFrame InstanceStream::wanted_in(const SegmentedFrame& found) const {
  SegmentedFrame wanted = found;
  std::erase_if(wanted.instances, [this](const Instance& instance) {
    return !wanted_classes_.contains(instance.class_name);
  });
  return wanted;
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
  const auto take = [this](const std::optional<FoundThings>& found) {
    if (!found) return false;
    carrier_.set(wanted_in(*found->instances));
    newest_found_ = *found;
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
