// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/mapping.hpp"

#include "stillmap/base/stopwatch.hpp"

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
      mapper_(map_, options.mapper) {
  stage_ = std::make_unique<Stage<KeyframeProposal, LocalMapPtr>>(
      kQueue, WhenFull::kBlock,
      [this](const KeyframeProposal& proposal, const auto& publish) { work(proposal, publish); });
}

void Mapping::work(const KeyframeProposal& proposal,
                   const std::function<void(LocalMapPtr)>& publish) {
  Stopwatch watch;
  const KeyframeId id = mapper_.insert(proposal);
  keyframe_of_[proposal.frame->index()] = id;
  publish(mapper_.local_map(id));
  timing_.add("keyframe insertion", watch.lap());
  // A newer keyframe matters more than the last digit of this one's surroundings, where time is
  // real.
  StopRequest hurry;
  if (schedule_.realtime()) hurry = [this] { return stage_->waiting() > 0; };
  const RefineReport report = mapper_.refine(id, hurry);
  publish(mapper_.local_map(id));
  timing_.add("map refinement", watch.lap());
}

void Mapping::push(const KeyframeProposal& proposal) {
  const std::size_t now = proposal.frame->index();
  stage_->push(proposal);
  due_.push_back(now + static_cast<std::size_t>(schedule_.insert_delay));
  due_.push_back(now + static_cast<std::size_t>(schedule_.refine_delay));
  if (!proposal.reference.valid()) {
    ++components_;
    await_first_ = true;
  }
}

LocalMapPtr Mapping::local_map_for(std::size_t frame_index) {
  if (schedule_.realtime()) {
    while (!due_.empty()) {
      auto snapshot = await_first_ ? stage_->take() : stage_->try_take();
      if (!snapshot) break;
      newest_ = *snapshot;
      due_.pop_front();
      if (await_first_ && newest_->component + 1 == components_) await_first_ = false;
    }
    return newest_;
  }
  while (!due_.empty() && due_.front() <= frame_index) {
    newest_ = stage_->take().value();
    due_.pop_front();
  }
  return newest_;
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
