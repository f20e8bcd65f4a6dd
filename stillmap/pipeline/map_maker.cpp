// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/map_maker.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <utility>

namespace stillmap {

MapMaker::MapMaker(Map map, const SlamParameters& options)
    : options_(options.mapper),
      map_(std::move(map)),
      mapper_(map_, options.mapper),
      places_(options.places),
      pager_({options.keyframe_memory, options.dense.memory.folder}) {
  std::vector<KeyframeId> loaded;
  map_.for_each_keyframe([&](const Keyframe& k) {
    places_.add(map_, k.id);
    loaded.push_back(k.id);
  });
  pager_.use(map_, loaded);
}

/// Returns the local map snapshot around a keyframe, whose features are in use from now on.
LocalMapPtr MapMaker::snapshot_around(KeyframeId reference) {
  LocalMapPtr snapshot = mapper_.local_map(reference);
  std::vector<KeyframeId> used;
  for (const LocalKeyframe& k : snapshot->keyframes) used.push_back(k.id);
  pager_.use(map_, used);
  return snapshot;
}

LocalMapPtr MapMaker::insert(const KeyframeProposal& proposal) {
  const TraceScope scope(span::kKeyframeInsertion);
  newest_ = mapper_.insert(proposal);
  made_.push_back(newest_);
  const KeyframeId abandoned = map_.current_keyframe(proposal.abandoned);
  if (abandoned.valid()) drop(map_.at(abandoned).component);
  const KeyframeId replaced = map_.current_keyframe(proposal.replaced);
  if (replaced.valid()) map_.erase_component(map_.at(replaced).component);
  return snapshot_around(newest_);
}

LocalMapPtr MapMaker::refine(const StopRequest& hurry) {
  {
    const TraceScope scope(span::kMapRefinement);
    refined_.add(mapper_.refine(newest_, hurry));
  }
  index_keyframe(newest_);
  return snapshot_around(newest_);
}

void MapMaker::index_keyframe(KeyframeId keyframe) {
  std::optional<LoopMatch> match;
  {
    const TraceScope scope(span::kPlaceRecognition);
    places_.add(map_, keyframe);
    match = places_.recognize(map_, keyframe);
  }
  if (match) close(*match);
}

void MapMaker::close(const LoopMatch& match) {
  const Stopwatch watch;
  const TraceScope scope(span::kLoopClosing);
  const LoopCorrection done = match.same_component ? close_loop(map_, match) : join(match);
  pending_global_ba_ = map_.at(match.query).component;
  moved_ = true;
  const Keyframe& query = map_.at(match.query);
  events_.push_back({match.same_component ? MapEvent::Kind::kLoop : MapEvent::Kind::kMerge,
                     query.frame_index, query.timestamp, map_.at(match.candidate).frame_index,
                     match.inliers, done.fused, done.meters, done.radians, done.keyframes,
                     done.graph_ms, watch.milliseconds()});
}

/// Merges the components, adjusts the seam, and propagates the correction.
LoopCorrection MapMaker::join(const LoopMatch& match) {
  LoopCorrection done = join_maps(map_, match);
  const EssentialGraph before(map_, map_.at(match.query).component);
  adjust_locally(map_, match.query, options_.local_window);
  const Stopwatch watch;
  propagate_correction(map_, before);
  done.graph_ms = watch.milliseconds();
  return done;
}

LocalMapPtr MapMaker::snapshot_for(const KeyframeProposal& proposal) {
  const KeyframeId center = best_view(map_, proposal.landmarks);
  return snapshot_around(center.valid() ? center : map_.current_keyframe(proposal.reference));
}

std::optional<RelocalizationResult> MapMaker::find(const FramePtr& lost, std::string& reason) {
  const TraceScope scope(span::kRelocalization);
  const RelocalizationVerification verification = places_.find(map_, *lost);
  reason = verification.reason;
  if (!verification.result) return std::nullopt;
  const Relocalization& r = *verification.result;
  return RelocalizationResult{lost, snapshot_around(r.reference), r.T_reference_camera, r.landmarks,
                              r.inliers};
}

std::shared_ptr<const MapBundle> MapMaker::take_pending_global_ba() {
  if (!pending_global_ba_) return nullptr;
  return std::make_shared<MapBundle>(
      whole_component(map_, *std::exchange(pending_global_ba_, std::nullopt)));
}

void MapMaker::apply_global_ba(const MapBundle& bundle, const BundleResult& result) {
  const TraceScope scope(span::kApplyingGlobalAdjustment);
  apply_to_grown_map(map_, bundle, result);
  moved_ = true;
}

KeyframePoses MapMaker::poses_around(KeyframeId keyframe) const {
  KeyframePoses poses;
  const KeyframeId around = map_.current_keyframe(keyframe);
  if (!around.valid()) return poses;
  const std::uint32_t component = map_.at(around).component;
  map_.for_each_keyframe([&](const Keyframe& k) {
    if (k.component == component) poses[k.id] = k.T_world_camera;
  });
  for (const KeyframeId id : made_) {
    const KeyframeId current = map_.current_keyframe(id);
    if (!current.valid() || current == id || map_.at(current).component != component) continue;
    poses[id] = map_.resolve(id, Pose());
  }
  return poses;
}

std::shared_ptr<const KeyframePoses> MapMaker::take_moved() {
  if (!std::exchange(moved_, false)) return nullptr;
  return std::make_shared<KeyframePoses>(poses_around(newest_));
}

void MapMaker::merge_remaining() {
  std::vector<std::uint32_t> components = map_.components();
  if (components.size() < 2) return;
  const TraceScope scope(span::kFinalMerging);
  std::reverse(components.begin(), components.end());
  for (const std::uint32_t component : components) {
    // An earlier step may have merged the component into another one.
    if (keyframes_of(map_, component).empty()) continue;
    if (const auto match = places_.connect(map_, component)) close(*match);
  }
}

void MapMaker::drop(std::uint32_t component) {
  const std::vector<KeyframeId> keyframes = keyframes_of(map_, component);
  const auto made_before = [&](KeyframeId id) { return map_.at(id).session != map_.session(); };
  if (std::any_of(keyframes.begin(), keyframes.end(), made_before)) return;
  const Keyframe& first = map_.at(keyframes.front());
  MapEvent event{.kind = MapEvent::Kind::kDropped};
  event.frame_index = first.frame_index;
  event.timestamp = first.timestamp;
  event.keyframes = keyframes.size();
  events_.push_back(event);
  map_.erase_component(component);
}

void MapMaker::adjust_all() {
  const TraceScope scope(span::kFinalAdjustment);
  for (const std::uint32_t component : map_.components()) adjust_globally(map_, component);
}

}  // namespace stillmap
