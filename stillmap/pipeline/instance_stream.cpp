// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/instance_stream.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/segment/tolerant_detector.hpp"

namespace stillmap {
namespace {

/// Returns the classes that a motion cue uses or that the dense map leaves out.
std::set<std::string> wanted_classes(const SlamParameters& options) {
  std::set<std::string> classes = MotionEstimator(options.motion).classes();
  if (options.dense_cloud) classes.insert(options.dense.movers.begin(), options.dense.movers.end());
  return classes;
}

ScheduleOptions schedule_for(const Detector* detector, ScheduleOptions schedule) {
  const bool immediate = detector != nullptr && detector->immediate();
  if (schedule.segment_every == 0) schedule.segment_every = immediate ? 1 : 3;
  if (schedule.mask_delay < 0) schedule.mask_delay = immediate ? 0 : 2;
  return schedule;
}

std::optional<DetectorUse> use_of(const Detector* detector, const ScheduleOptions& schedule) {
  if (detector == nullptr) return std::nullopt;
  return DetectorUse{detector->inference(), schedule.segment_every, schedule.mask_delay};
}

std::unique_ptr<Detector> tolerant(std::unique_ptr<Detector> detector) {
  return detector ? std::make_unique<TolerantDetector>(std::move(detector)) : nullptr;
}

}  // namespace

InstanceStream::InstanceStream(std::unique_ptr<Detector> detector, const SlamParameters& options)
    : schedule_(schedule_for(detector.get(), options.schedule)),
      use_(use_of(detector.get(), schedule_)),
      waits_(!schedule_.realtime || schedule_.mask_delay == 0),
      wanted_classes_(wanted_classes(options)),
      detector_(tolerant(std::move(detector))),
      propagator_(options.schedule.max_mask_age) {
  if (!detector_) return;
  // A detector that nobody waits for gets the newest frame whenever it is free, so one may wait.
  detect_stage_ = std::make_unique<Stage<RgbdFramePtr, DetectedObjects>>(
      waits_ ? 8 : 1, waits_ ? WhenFull::kBlock : WhenFull::kDrop,
      [this](const RgbdFramePtr& frame, const auto& publish) { publish(detect(frame)); }, "network",
      ThreadPriority::kNetwork);
  propagation_stage_ = std::make_unique<Stage<PropagationTask, FrameInstances>>(
      1, WhenFull::kBlock,
      [this](const PropagationTask& task, const auto& publish) { publish(propagate(task)); },
      kThread);
}

void InstanceStream::push(const RgbdFramePtr& frame, const CellGridPtr& cells) {
  if (!detector_) return;
  const bool first = due_.empty() && visible_ == 0;
  const bool its_turn = frame->index % static_cast<std::size_t>(schedule_.segment_every) == 0;
  if ((first || its_turn) && detect_stage_->push(frame)) {
    const int delay = first ? 0 : schedule_.mask_delay;
    due_.push_back(frame->index + static_cast<std::size_t>(delay));
  }
  for (; !due_.empty() && due_.front() <= frame->index; due_.pop_front()) ++visible_;
  propagation_stage_->push({frame, cells, visible_});
}

FrameInstances InstanceStream::wait() {
  if (!detector_) return {};
  return propagation_stage_->pop().value();
}

DetectedObjects InstanceStream::detect(const RgbdFramePtr& frame) {
  trace_frame(frame->index);
  const TraceScope scope(span::kSegmentation);
  auto found = std::make_shared<SegmentedFrame>();
  found->frame_index = found->source_index = frame->index;
  found->instances = detector_->detect(*frame);
  ++segmented_;
  return {frame, found};
}

FrameInstances InstanceStream::propagate(const PropagationTask& task) {
  trace_frame(task.frame->index);
  traced(span::kMaskPropagation, [&] { propagator_.push(task.frame); });
  collect(task.visible);
  FrameInstances known;
  traced(span::kMaskPropagation, [&] {
    known.propagated = propagator_.current();
    known.propagated_cells =
        traced("instance cells", [&] { return instance_cells(known.propagated, *task.cells); });
  });
  known.detected = newest_;
  known.milliseconds = traced_in_frame(span::kMaskPropagation);
  return known;
}

void InstanceStream::collect(std::size_t visible) {
  const bool wait = waits_ || accepted_ == 0;
  while (wait && accepted_ < visible) accept(detect_stage_->pop().value());
  while (!waits_) {
    const auto detected = detect_stage_->try_pop();
    if (!detected) break;
    accept(*detected);
  }
}

void InstanceStream::accept(const DetectedObjects& detected) {
  propagator_.set(wanted_in(*detected.instances));
  newest_ = detected;
  ++accepted_;
}

/// Returns the instances that a cue or the dense map uses; only these are propagated, to save time.
SegmentedFrame InstanceStream::wanted_in(const SegmentedFrame& found) const {
  SegmentedFrame wanted = found;
  std::erase_if(wanted.instances, [this](const Instance& instance) {
    return !wanted_classes_.contains(instance.class_name);
  });
  return wanted;
}

void InstanceStream::finish() {
  if (propagation_stage_) propagation_stage_->drain();
  if (detect_stage_) detect_stage_->drain();
  if (detector_) {
    skipped_ = detector_->skipped();
    failures_ = detector_->failures();
    finding_ = detector_->finding();
  }
  detector_.reset();
}

}  // namespace stillmap
