// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/map_maker.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/keypoint_depths.hpp"
#include "stillmap/refine/culling.hpp"
#include "stillmap/refine/map_depth_error.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace stillmap {
namespace {

/// Number of shared landmarks that connects two keyframes well enough without another loop.
constexpr int kConnected = 15;

/// Number of keyframes up to which the error of the depths is looked for, since the whole map is
/// adjusted where it is found.
constexpr std::size_t kMostDepthChecked = 40;

/// Returns T_first_second by a match, where the first is the world frame of the component with the
/// smaller id and the second that of the other component.
Pose motion_between(const Map& map, const LoopMatch& match) {
  const Keyframe& query = map.at(match.query);
  const Keyframe& candidate = map.at(match.candidate);
  const Pose T_candidates_query_world =
      candidate.T_world_camera * match.T_candidate_query * query.T_world_camera.inverse();
  return candidate.component < query.component ? T_candidates_query_world
                                               : T_candidates_query_world.inverse();
}

/// Returns the two keyframes of a match, beginning with the one in the component of larger id.
std::pair<KeyframeId, KeyframeId> keyframes_in(const Map& map, const LoopMatch& match) {
  std::pair<KeyframeId, KeyframeId> pair{match.query, match.candidate};
  if (map.at(pair.first).component < map.at(pair.second).component)
    std::swap(pair.first, pair.second);
  return pair;
}

/// Returns whether two matches of the same components, of different queries, show the same motion
/// between these, but for the drift of the maps.
bool confirm_each_other(const Map& map, const LoopMatch& a, const LoopMatch& b) {
  const auto of_a = keyframes_in(map, a), of_b = keyframes_in(map, b);
  if (a.query == b.query) return false;
  const auto components = [&](const auto& pair) {
    return std::pair(map.at(pair.first).component, map.at(pair.second).component);
  };
  if (components(of_a) != components(of_b)) return false;
  const Pose motion_a = motion_between(map, a), motion_b = motion_between(map, b);
  const Eigen::Vector3d at = map.at(of_a.first).T_world_camera.translation();
  const double path = (map.at(of_b.first).T_world_camera.translation() - at).norm();
  const DriftLimits limits;
  return (motion_a * at - motion_b * at).norm() < limits.meters + limits.meters_per_meter * path &&
         (motion_a.inverse() * motion_b).angle() < limits.radians + limits.radians_per_meter * path;
}

/// Returns the indices of the verified comparisons that another one confirms, those with most
/// inliers first.
std::vector<std::size_t> confirmed(const Map& map, const std::vector<PlaceComparison>& all) {
  const auto match = [&](std::size_t i) -> const std::optional<LoopMatch>& {
    return all[i].verification.match;
  };
  std::vector<std::size_t> verified, chosen;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (match(i)) verified.push_back(i);
  }
  std::copy_if(verified.begin(), verified.end(), std::back_inserter(chosen), [&](std::size_t i) {
    return std::any_of(verified.begin(), verified.end(), [&](std::size_t k) {
      return confirm_each_other(map, *match(i), *match(k));
    });
  });
  std::stable_sort(chosen.begin(), chosen.end(), [&](std::size_t i, std::size_t k) {
    return match(i)->inliers > match(k)->inliers;
  });
  return chosen;
}

/// Merges the landmarks of two keyframes that were made of the same frame, keypoint by keypoint,
/// into those of the second.
void merge_landmarks_of_equal_keypoints(Map& map, KeyframeId newer, KeyframeId older) {
  for (std::uint32_t i = 0; i < map.at(newer).landmarks.size(); ++i) {
    const LandmarkId of_newer = map.at(newer).landmarks[i], of_older = map.at(older).landmarks[i];
    if (!of_newer.valid() || of_newer == of_older) continue;
    if (of_older.valid()) {
      map.merge(of_older, of_newer);
    } else if (map.observe(of_newer, {older, i})) {
      map.refresh(of_newer);
    }
  }
}

bool share_landmarks(const Map& map, KeyframeId a, KeyframeId b, int least) {
  const auto covisible = map.covisible(a, least);
  return std::any_of(covisible.begin(), covisible.end(),
                     [&](const Covisible& c) { return c.keyframe == b; });
}

}  // namespace

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

/// Compares the texture of an image with the landmarks of earlier sessions around its pose.
void MapMaker::compare_texture(const KeyframeProposal& proposal) {
  constexpr int kWindow = 10;    // number of covisible keyframes whose landmarks take part
  constexpr double kRadius = 4;  // as in relocalization [pixels at level 0]
  const KeyframeId center = best_view(map_, proposal.landmarks);
  if (!center.valid()) return;
  std::vector<KeyframeId> earlier = with_best_covisible(map_, center, kWindow);
  std::erase_if(earlier, [&](KeyframeId id) { return map_.at(id).session == map_.session(); });
  const Frame& frame = *proposal.frame;
  texture_ += texture_agreement(
      map_, landmarks_seen_by(map_, earlier), {*frame.features, frame.evidence.weight},
      map_.resolve(proposal.reference, proposal.T_reference_camera), kRadius);
}

LocalMapPtr MapMaker::insert(const KeyframeProposal& proposal) {
  const TraceScope scope(span::kKeyframeInsertion);
  compare_texture(proposal);
  newest_ = mapper_.insert(proposal);
  made_.push_back(newest_);
  const KeyframeId abandoned = map_.current_keyframe(proposal.abandoned);
  if (abandoned.valid()) drop(map_.at(abandoned).component);
  const KeyframeId replaced = map_.current_keyframe(proposal.replaced);
  if (replaced.valid()) map_.erase_made_in(map_.at(replaced).component);
  return snapshot_around(newest_);
}

AddedMap MapMaker::add(MapContent content, KeyframeId here) {
  const auto components = static_cast<std::uint32_t>(content.first.size());
  AddedMap added{map_.add(std::move(content), MapAge::kOlder), {}, nullptr, {}};
  for (const KeyframeId id : added.keyframes) places_.add(map_, id);
  pager_.use(map_, added.keyframes);
  merge_remaining();
  added.repeated = erase_repeated_keyframes(added.keyframes);
  here = map_.current_keyframe(here);
  if (!here.valid())
    added.not_found = "no keyframe has been made yet";
  else if (map_.at(here).component >= components)
    added.not_found = places_.why_unknown(map_, here);
  else
    added.local_map = snapshot_around(here);
  return added;
}

LocalMapPtr MapMaker::refine(const StopRequest& hurry) {
  {
    const TraceScope scope(span::kMapRefinement);
    refined_.add(mapper_.refine(newest_, hurry));
  }
  index_keyframe(newest_);
  check_depths();
  return snapshot_around(newest_);
}

/// Removes the error of the depths that the first keyframes of the run show. It is looked for
/// whenever there are a quarter more keyframes: the earlier it is known, the fewer poses that
/// were returned contradict the map.
void MapMaker::check_depths() {
  if (!options_.remove_depth_error || made_.size() != next_depth_check_) return;
  if (made_.size() < kMostDepthChecked)
    next_depth_check_ += std::max<std::size_t>(1, made_.size() / 4);
  const auto error = depth_error_of(map_);
  if (!error) return;
  remove_depth_error(*error);
  const std::uint32_t component = map_.at(newest_).component;
  const KeyframeId first = map_.current_keyframe(map_.first_of(component));
  if (first.valid() && map_.at(first).session == map_.session())
    adjust_globally(map_, component);
  else  // a saved map keeps its scale
    adjust_locally(map_, newest_, options_.local_window);
  if (adjusting_) pending_global_ba_ = component;
  moved_ = true;
}

/// Removes a further error from the depths of the run's keyframes.
void MapMaker::remove_depth_error(const SmoothDepthError& error) {
  const DepthErrorPtr removed = map_.depth_error();
  map_.set_depth_error(std::make_shared<SmoothDepthError>(removed ? *removed + error : error));
  std::vector<KeyframeId> changed;
  map_.for_each_keyframe([&](const Keyframe& k) {
    if (k.session == map_.session()) changed.push_back(k.id);
  });
  for (const KeyframeId id : changed) {
    pager_.replace(
        map_, id,
        without_depth_error(map_.at(id).features, map_.depth_error(), removed, map_.camera()));
  }
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
  compare_texture(proposal);
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
  adjusting_ = true;
  return std::make_shared<MapBundle>(
      whole_component(map_, *std::exchange(pending_global_ba_, std::nullopt)));
}

void MapMaker::apply_global_ba(const MapBundle& bundle, const BundleResult& result) {
  const TraceScope scope(span::kApplyingGlobalAdjustment);
  apply_to_grown_map(map_, bundle, result);
  adjusting_ = false;
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

std::vector<PlaceComparison> MapMaker::merge_all() {
  std::vector<PlaceComparison> comparisons = places_.compare_components(map_);
  const std::vector<std::size_t> chosen = confirmed(map_, comparisons);
  std::map<std::uint32_t, std::size_t> adjusted;  // numbers of keyframes, by component
  for (const std::size_t i : chosen) {
    comparisons[i].confirmed = true;
    const LoopMatch& match = *comparisons[i].verification.match;
    if (map_.at(match.query).component == map_.at(match.candidate).component) continue;
    close(match);
    const std::uint32_t component = map_.at(match.query).component;
    const std::size_t keyframes = keyframes_of(map_, component).size();
    if (keyframes < 2 * adjusted[component]) continue;
    adjust_globally(map_, component);
    adjusted[component] = keyframes;
  }
  for (const std::size_t i : chosen) {
    const auto& [query, candidate, verification, confirmed] = comparisons[i];
    if (share_landmarks(map_, query, candidate, kConnected)) continue;
    const LoopVerification now = places_.verify(map_, query, candidate);
    if (now.match) close(*now.match);
  }
  return comparisons;
}

std::vector<RepeatedKeyframe> MapMaker::erase_repeated_keyframes(
    const std::vector<KeyframeId>& kept) {
  std::map<double, std::vector<KeyframeId>> by_time;
  std::vector<RepeatedKeyframe> repeated;
  const auto add = [&](const Keyframe& k) {
    std::vector<KeyframeId>& others = by_time[k.timestamp];
    const auto same = std::find_if(others.begin(), others.end(), [&](KeyframeId id) {
      return map_.at(id).component == k.component &&
             map_.at(id).features->descriptors == k.features->descriptors;
    });
    if (same == others.end())
      others.push_back(k.id);
    else if (*same != k.id)
      repeated.push_back({k.id, *same});
  };
  for (const KeyframeId id : kept) add(map_.at(id));
  map_.for_each_keyframe(add);
  for (const auto& [erased, by] : repeated) {
    merge_landmarks_of_equal_keypoints(map_, erased, by);
    map_.erase(erased, by);
  }
  return repeated;
}

std::size_t MapMaker::erase_redundant_keyframes() {
  return static_cast<std::size_t>(cull_keyframes(map_));
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
  map_.erase_made_in(component);
}

void MapMaker::adjust_all() {
  const TraceScope scope(span::kFinalAdjustment);
  for (const std::uint32_t component : map_.components()) adjust_globally(map_, component);
}

}  // namespace stillmap
