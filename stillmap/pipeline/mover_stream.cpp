// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/mover_stream.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/motion/mover_joining.hpp"

namespace stillmap {

MoverStream::MoverStream(const MoverOptions& options, bool realtime) : realtime_(realtime) {
  if (!options.enabled) return;
  stage_ = std::make_unique<Stage<TrackedFramePtr, MoversAtTime>>(
      8, WhenFull::kBlock,
      [this](const TrackedFramePtr& tracked, const auto& publish) {
        trace_frame(tracked->frame->index());
        const TraceScope scope(span::kMovers);
        publish({tracked->frame->timestamp(), work(*tracked)});
      },
      "movers", ThreadPriority::kBackground);
}

void MoverStream::push(const TrackedFramePtr& tracked) {
  if (!stage_ || !tracked->has_pose()) return;
  if (realtime_ && !tracked->enters_world() && stage_->waiting() >= 2) {
    ++frames_skipped_;
  } else {
    stage_->push(tracked);
  }
  newest(false);  // takes the outputs, so that they do not accumulate
}

std::vector<Mover> MoverStream::work(const TrackedFrame& tracked) {
  if (tracked.enters_world()) {
    detector_.restart();
    tracker_.restart();
  } else {
    const Pose T_corrected_world = tracked.T_odometry_world.inverse() * T_odometry_world_;
    detector_.move(T_corrected_world);
    tracker_.move(T_corrected_world);
  }
  T_odometry_world_ = tracked.T_odometry_world;
  const Frame& frame = *tracked.frame;
  const MoverDetections found = detector_.detect(frame, *tracked.T_world_camera);
  statistics_.detections += found.movers.size();
  statistics_.too_small += static_cast<std::size_t>(found.too_small);
  statistics_.without_depth += static_cast<std::size_t>(found.without_depth);
  tracker_.update(frame.index(), frame.timestamp(), *tracked.T_world_camera, found.movers);
  return tracker_.current();
}

std::vector<Mover> MoverStream::newest(bool wait) {
  if (!stage_) return {};
  if (wait) stage_->drain();
  while (auto output = stage_->try_pop()) {
    newest_ = std::move(output->movers);
    newest_time_ = output->timestamp;
  }
  return newest_;
}

std::future<std::vector<Mover>> MoverStream::ask() const {
  const auto current = [this] {
    const TraceBinding untraced(nullptr);  // the query is not work on a frame
    return tracker_.current();
  };
  return stage_ ? stage_->ask(current) : std::async(std::launch::deferred, current);
}

std::future<void> MoverStream::ask(std::function<void(const MoverTracker&)> read) const {
  auto ask = [this, read = std::move(read)] {
    const TraceBinding untraced(nullptr);  // the query is not work on a frame
    read(tracker_);
  };
  return stage_ ? stage_->ask(std::move(ask)) : std::async(std::launch::deferred, std::move(ask));
}

void MoverStream::finish() {
  if (stage_) stage_->drain();
}

std::vector<MoverTrack> MoverStream::tracks(
    const std::function<std::optional<Pose>(std::size_t)>& pose_of) const {
  return joined_movers(tracker_.tracks(pose_of));
}

}  // namespace stillmap
