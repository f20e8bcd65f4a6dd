// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/mapping.hpp"

#include "stillmap/base/span_names.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace stillmap {
namespace {

/// Length of the queue of keyframes; at a few per second, mapping is seconds behind if it is full.
constexpr std::size_t kQueue = 16;

/// Largest number of pending updates in realtime, two for each keyframe. With more of them the
/// tracker would leave the part of the map that it knows, so it waits and drops frames.
constexpr std::size_t kMaxPendingUpdates = 6;

/// Frame index after all others.
constexpr std::size_t kAtTheEnd = std::numeric_limits<std::size_t>::max();

}  // namespace

Mapping::Mapping(Map map, const SlamParameters& options, bool extend)
    : schedule_(options.schedule),
      final_adjustment_(options.final_adjustment),
      extend_(extend),
      extended_(extend),
      maker_(std::move(map), options) {
  // In lockstep the tracker waits for a global adjustment, so it must not wait for an idle core.
  const auto adjuster_priority =
      schedule_.realtime ? ThreadPriority::kIdle : ThreadPriority::kBackground;
  adjuster_ = std::make_unique<AdjustStage>(
      kQueue, WhenFull::kBlock,
      [this](const BundlePtr& bundle, const auto& publish) { adjust(bundle, publish); },
      "whole map", adjuster_priority);
  stage_ = std::make_unique<MapStage>(
      kQueue, WhenFull::kBlock, [](const auto& task, const auto& publish) { task(publish); }, "map",
      ThreadPriority::kMap);
}

void Mapping::set_extend(bool extend) {
  extend_ = extend;
  extended_ |= extend;
}

AddedMap Mapping::add(MapContent content, std::size_t frame_index) {
  AddedMap added;
  stage_->push([&](const MapStage::Publish& publish) {
    added = maker_.add(std::move(content), newest_ ? newest_->reference : KeyframeId());
    if (added.local_map) publish({.local_map = added.local_map, .moved = maker_.take_moved()});
    begin_adjustment(frame_index);
  });
  stage_->drain();
  if (added.local_map) expect(frame_index);
  return added;
}

void Mapping::push_work(const TrackedFramePtr& tracked) {
  stage_->push([this, tracked, extend = extend_](const MapStage::Publish& publish) {
    work(*tracked, extend, publish);
  });
}

void Mapping::work(const TrackedFrame& tracked, bool extend, const MapStage::Publish& publish) {
  trace_frame(tracked.frame->index());
  if (!tracked.proposal) {
    publish(relocalization_update(tracked.frame));
    return;
  }
  apply_due_adjustment(tracked.frame->index());
  if (!extend) {
    MapUpdate around{maker_.snapshot_for(*tracked.proposal)};
    publish(around);
    around.moved = maker_.take_moved();
    publish(std::move(around));
    return;
  }
  MapUpdate inserted{maker_.insert(*tracked.proposal)};
  inserted.moved = maker_.take_moved();
  inserted.made = {tracked.frame->index(), tracked.frame->timestamp(), maker_.newest()};
  publish(std::move(inserted));
  // In realtime a newer keyframe is more important than convergence around this one.
  StopRequest hurry;
  if (schedule_.realtime) hurry = [this] { return stage_->waiting() > 0; };
  MapUpdate refined{maker_.refine(hurry)};
  refined.moved = maker_.take_moved();
  publish(std::move(refined));
  begin_adjustment(tracked.frame->index());
}

/// Returns the relocalization result with the poses around it.
Mapping::MapUpdate Mapping::relocalization_update(const FramePtr& lost) {
  MapUpdate answer;
  answer.found = maker_.find(lost, answer.not_found);
  if (answer.found) {
    answer.moved =
        std::make_shared<KeyframePoses>(maker_.poses_around(answer.found->local_map->reference));
  }
  return answer;
}

/// Runs global bundle adjustment on a copy. It stops early if a newer loop invalidates the result.
void Mapping::adjust(const BundlePtr& bundle, const AdjustStage::Publish& publish) {
  BundleResult result;
  {
    const TraceScope scope(span::kGlobalAdjustment);
    result = adjust_bundle(bundle->problem, [this] { return adjuster_->waiting() > 0; });
  }
  publish({bundle, std::move(result)});
}

void Mapping::begin_adjustment(std::size_t frame_index) {
  const BundlePtr bundle = maker_.take_pending_global_ba();
  if (!bundle || bundle->free == 0) return;
  adjuster_->push(bundle);
  ++adjusting_;
  adjusted_by_ = frame_index + static_cast<std::size_t>(schedule_.global_delay);
}

void Mapping::apply_due_adjustment(std::size_t frame_index) {
  if (!schedule_.realtime && frame_index < adjusted_by_) return;
  const bool wait = !schedule_.realtime || frame_index == kAtTheEnd;
  while (adjusting_ > 0) {
    const auto adjusted = wait ? adjuster_->pop() : adjuster_->try_pop();
    if (!adjusted) return;
    if (--adjusting_ == 0) maker_.apply_global_ba(*adjusted->bundle, adjusted->result);
  }
}

void Mapping::push(const TrackedFramePtr& tracked) {
  const std::size_t now = tracked->frame->index();
  if (tracked->proposal) {
    push_work(tracked);
    const std::size_t inserted = now + static_cast<std::size_t>(schedule_.insert_delay);
    // The snapshot of a new map does not wait for pending updates of the previous one.
    if (tracked->starts_part())
      for (std::size_t& due : due_) due = std::min(due, inserted);
    expect(inserted);
    expect(now + static_cast<std::size_t>(schedule_.refine_delay));
    if (tracked->starts_part()) {
      awaited_ = now;
      relocalization_outdated_ = relocalizing_;
    }
  } else if ((tracked->state == TrackState::kLost || tracked->state == TrackState::kPredicted ||
              tracked->tracked_by_odometry) &&
             !relocalizing_) {
    push_work(tracked);
    expect(now + static_cast<std::size_t>(schedule_.relocalize_delay));
    relocalizing_ = true;
  }
}

/// Adds an expected update. Updates arrive in the order of their requests, so none becomes visible
/// before an earlier one.
void Mapping::expect(std::size_t frame_index) {
  due_.push_back(due_.empty() ? frame_index : std::max(due_.back(), frame_index));
}

std::optional<Mapping::MapUpdate> Mapping::next_update(std::size_t frame_index) {
  if (due_.empty() || (!schedule_.realtime && due_.front() > frame_index)) return std::nullopt;
  const bool wait = !schedule_.realtime || awaited_ || due_.size() > kMaxPendingUpdates;
  auto update = wait ? stage_->pop() : stage_->try_pop();
  if (update) due_.pop_front();
  return update;
}

MapView Mapping::view_for(std::size_t frame_index) {
  MapView view;
  while (auto update = next_update(frame_index)) {
    if (update->moved) view.moved = update->moved;
    if (update->made.id.valid()) view.made.push_back(update->made);
    if (update->local_map) {
      newest_ = update->local_map;
      if (awaited_ && newest_->made_for_frame >= *awaited_) awaited_.reset();
    } else {
      relocalizing_ = false;
      not_found_ = std::move(update->not_found);
      if (!std::exchange(relocalization_outdated_, false)) view.found = std::move(update->found);
    }
  }
  view.local_map = newest_;
  view.not_found = not_found_;
  return view;
}

MapView Mapping::drain() {
  stage_->drain();
  MapView view = view_for(kAtTheEnd);
  change([this] {
    apply_due_adjustment(kAtTheEnd);
    if (extended_) maker_.merge_remaining();
  });
  return view;
}

void Mapping::drop(std::uint32_t component) {
  change([&] { maker_.drop(component); });
}

void Mapping::finish() {
  if (final_adjustment_ && extended_) change([this] { maker_.adjust_all(); });
}

/// Changes the map on its own thread, so that it never changes during ask().
void Mapping::change(const std::function<void()>& work) {
  const TraceScope waiting(span::kWaitingForMap);
  stage_
      ->ask([&work] {
        trace_no_frame();
        work();
      })
      .get();
}

std::future<void> Mapping::ask(std::function<void(const MapMaker&)> read) {
  return stage_->ask([this, read = std::move(read)] {
    const TraceBinding untraced(nullptr);  // the query is not work on the map
    read(maker_);
  });
}

}  // namespace stillmap
