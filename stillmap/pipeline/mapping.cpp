// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/mapping.hpp"

#include "stillmap/base/stopwatch.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Keyframes come a few a second; a queue this long means that the mapper is seconds behind.
constexpr std::size_t kQueue = 16;

}  // namespace

Mapping::Mapping(const Camera& camera, const PyramidShape& pyramid, const SlamOptions& options)
    : schedule_(options.schedule),
      final_adjustment_(options.final_adjustment),
      bundle_(options.mapper.adjustment.bundle),
      map_(camera, pyramid),
      mapper_(map_, options.mapper),
      places_(options.places) {
  stage_ = std::make_unique<MapStage>(
      kQueue, WhenFull::kBlock, [this](const TrackedFramePtr& tracked, const auto& publish) {
        tracked->proposal ? add(*tracked->proposal, publish) : find(tracked->frame, publish);
      });
}

void Mapping::add(const KeyframeProposal& proposal, const MapStage::Publish& publish) {
  Stopwatch watch;
  const KeyframeId id = mapper_.insert(proposal);
  keyframe_of_[proposal.frame->index()] = id;
  publish({mapper_.local_map(id), std::nullopt});
  timing_.add("keyframe insertion", watch.lap());
  // A newer keyframe matters more than the last digit of this one's surroundings, where time is
  // real.
  StopRequest hurry;
  if (schedule_.realtime()) hurry = [this] { return stage_->waiting() > 0; };
  const RefineReport report = mapper_.refine(id, hurry);
  publish({mapper_.local_map(id), std::nullopt});
  timing_.add("map refinement", watch.lap());
  places_.add(map_, id);
  timing_.add("place recognition", watch.lap());
}

void Mapping::find(const FramePtr& lost, const MapStage::Publish& publish) {
  const Stopwatch watch;
  News answer;
  if (const auto verdict = places_.find(map_, *lost); verdict.result) {
    const Relocalisation& r = *verdict.result;
    answer.found = Placement{lost, mapper_.local_map(r.reference), r.T_reference_camera,
                             r.landmarks, r.inliers};
  }
  publish(std::move(answer));
  timing_.add("relocalisation", watch.milliseconds());
}

void Mapping::push(const TrackedFramePtr& tracked) {
  const std::size_t now = tracked->frame->index();
  if (tracked->proposal) {
    stage_->push(tracked);
    expect(now + static_cast<std::size_t>(schedule_.insert_delay));
    expect(now + static_cast<std::size_t>(schedule_.refine_delay));
    if (tracked->state == TrackState::kStarted) {
      ++components_;
      await_first_ = true;
    }
  } else if (tracked->state == TrackState::kLost && !seeking_) {
    stage_->push(tracked);
    expect(now + static_cast<std::size_t>(schedule_.relocalise_delay));
    seeking_ = true;
  }
}

/// News come in the order in which they were asked for, so none is visible before the one before.
void Mapping::expect(std::size_t frame_index) {
  due_.push_back(due_.empty() ? frame_index : std::max(due_.back(), frame_index));
}

std::optional<Mapping::News> Mapping::next_news(std::size_t frame_index) {
  if (due_.empty() || (!schedule_.realtime() && due_.front() > frame_index)) return std::nullopt;
  const bool wait = !schedule_.realtime() || await_first_;
  auto news = wait ? stage_->take() : stage_->try_take();
  if (news) due_.pop_front();
  return news;
}

MapView Mapping::view_for(std::size_t frame_index) {
  std::optional<Placement> found;
  while (auto news = next_news(frame_index)) {
    if (news->local_map) {
      newest_ = news->local_map;
      if (newest_->component + 1 == components_) await_first_ = false;
    } else {
      seeking_ = false;
      found = std::move(news->found);
    }
  }
  return {newest_, std::move(found)};
}

void Mapping::finish() {
  stage_->drain();
  if (!final_adjustment_) return;
  Stopwatch watch;
  for (std::uint32_t component = 0; component < components_; ++component) {
    adjust_globally(map_, component, bundle_);
  }
  timing_.add("final adjustment", watch.lap());
}

KeyframeId Mapping::keyframe_of(std::size_t frame_index) const {
  const auto found = keyframe_of_.find(frame_index);
  return found != keyframe_of_.end() ? found->second : KeyframeId{};
}

}  // namespace stillmap
