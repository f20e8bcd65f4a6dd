// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/slam.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/segment/dynamic_mask.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

// Frames that wait for the dense map; where time is real, enough for all to be placed anew while
// the camera goes on.
constexpr std::size_t kQueue = 8, kLongQueue = 24;

const SlamOptions& checked(const SlamOptions& options) {
  check_options(options);
  return options;
}

/// What moves in a frame, and what may: it has no place in a static map, even while it keeps still.
cv::Mat1b mover_pixels(const Frame& frame, const std::vector<std::string>& classes) {
  cv::Mat1b movers = frame.evidence.moving_pixels;
  if (!frame.instances || frame.instances->instances.empty() || classes.empty()) return movers;
  cv::Mat1b masks = dynamic_mask(*frame.instances, classes, frame.image->gray.size());
  if (movers.empty()) return masks;
  return movers | masks;
}

/// The static things that the detector found last, in the pixels of a keyframe; none where that was
/// too long ago.
SegmentedFrame objects_in(const DetectedObjects& found, const RgbdFrame& image,
                          const SlamOptions& options) {
  SegmentedFrame things{.frame_index = image.index, .source_index = image.index, .instances = {}};
  if (!found.image || found.image->index > image.index ||
      image.index - found.image->index > static_cast<std::size_t>(options.carry.max_age)) {
    return things;
  }
  const std::vector<std::string>& movers = options.dense.movers;
  for (Instance instance : found.instances->instances) {
    if (std::find(movers.begin(), movers.end(), instance.class_name) != movers.end()) continue;
    if (instance.mask.empty()) instance.mask = cluster_in_box(found.image->depth, instance.box);
    things.instances.push_back(std::move(instance));
  }
  if (things.instances.empty()) return things;
  things.frame_index = things.source_index = found.image->index;
  if (found.image->index == image.index) return trim_by_depth(things, image, options.carry);
  return propagate_masks(things, *found.image, image, options.carry);
}

TrackerStart how_to_begin(const std::optional<StartingMap>& start) {
  if (!start) return TrackerStart::kNewMap;
  return start->extend ? TrackerStart::kInMap : TrackerStart::kInMapOnly;
}

Map map_to_begin_in(const std::optional<StartingMap>& start, const Camera& camera,
                    const PyramidShape& pyramid) {
  if (!start) return {camera, pyramid};
  require_same_camera(start->saved.map, camera, pyramid, "the map to begin in");
  return Map(start->saved.map);
}

}  // namespace

Slam::Slam(const Camera& camera, const SlamOptions& options, std::unique_ptr<Detector> detector,
           std::optional<StartingMap> start)
    : options_(checked(options)),
      camera_(camera),
      extend_(!start || start->extend),
      extractor_(options.orb),
      keypoint_budget_(options.orb.keypoints),
      motion_(options.motion),
      tracker_(camera, options.orb.pyramid(), options.tracker, how_to_begin(start)),
      instances_(std::move(detector), options),
      mapping_(map_to_begin_in(start, camera, options.orb.pyramid()), options, extend_),
      dense_(camera, options.dense),
      movers_(options.movers, options.schedule.realtime()) {
  if (start && extend_ && options.dense_cloud) {
    hold(std::move(start->saved.views));
  }
  dense_stage_ = std::make_unique<Stage<DenseTask, Nothing>>(
      options.schedule.realtime() ? kLongQueue : kQueue, WhenFull::kBlock,
      [this](const DenseTask& task, const auto&) { work_on_dense_map(task); }, "dense map",
      ThreadPriority::kBackground);
}

Slam::~Slam() = default;

/// Without poses: they are told where the camera is recognized.
void Slam::hold(std::vector<AnchoredView> loaded) {
  for (AnchoredView& view : loaded) {
    view_places_[loaded_views_] = {view.anchor, view.T_anchor_camera};
    dense_.add(loaded_views_++, std::move(view.view));
  }
}

std::optional<Pose> Slam::push(const RgbdFramePtr& image) {
  check(*image);
  trace_frame(image->index);
  const TraceScope scope("frame");
  const Stopwatch since_push;
  Stopwatch watch;
  auto frame = std::make_shared<Frame>();
  frame->image = image;
  frame->cells = std::make_shared<CellGrid>(image->depth, camera_);
  const double gridding = watch.lap();
  instances_.push(image, frame->cells);
  frame->features = std::make_shared<Features>(
      extractor_.extract(image->gray, image->depth, keypoint_budget_.keypoints()));
  const double extracting = watch.lap();

  // Waiting is no work: a live camera's tracker takes what there is, a recording's may be ahead of
  // the others.
  const MapView map = mapping_.view_for(image->index);
  double waiting = watch.lap();

  const auto initial = tracker_.follow(*frame->features, map.local_map);
  const double following = watch.lap();

  MotionInput input{.image = image,
                    .features = frame->features,
                    .cells = frame->cells,
                    .instances = nullptr,
                    .instance_cells = nullptr,
                    .previous = newest_ ? newest_->frame : nullptr,
                    .ego_motion = initial ? std::optional(initial->motion) : std::nullopt};
  MotionEvidence evidence = motion_.begin(input);
  double judging = gridding + watch.lap();

  const SeenInstances seen = instances_.take();
  const double blocked = watch.lap();
  const double meanwhile = extracting + following + judging - gridding;
  const double carrying = std::clamp(seen.milliseconds - meanwhile, 0.0, blocked);
  waiting += blocked - carrying;  // for the network
  input.instances = frame->instances = seen.carried;
  input.instance_cells = frame->instance_cells = seen.propagated_cells;
  frame->evidence = motion_.finish(std::move(evidence), input);
  judging += watch.lap();
  newest_ = tracker_.track(frame, initial, map.local_map, map.found);
  const double posing = following + watch.lap();

  timing_.add("features", extracting);
  timing_.add("waiting for masks carried beside", carrying);
  timing_.add("motion", judging);
  for (const CueTiming& timed : motion_.timing()) {
    timing_.add("motion: " + timed.cue, timed.milliseconds);
  }
  timing_.add("pose", posing);
  const double tracking = extracting + carrying + judging + posing;
  timing_.add("tracking", tracking);
  timing_.add("waiting for network and map", waiting);
  if (newest_->relocalized) {
    mapping_.accept_relocalization(*map.found);
    record(*map.found);
  }
  mapping_.push(newest_);
  movers_.push(newest_);
  show_dense_map(map, seen.found);
  if (options_.schedule.realtime()) shed_load(*image, since_push.milliseconds());
  record(*newest_, tracking);
  return newest_->T_world_camera;
}

void Slam::check(const RgbdFrame& frame) const {
  const auto fits = [&](const cv::Mat& image, int type) {
    return image.cols == camera_.width && image.rows == camera_.height && image.type() == type;
  };
  if (!fits(frame.gray, CV_8UC1) || !fits(frame.depth, CV_32FC1) || !fits(frame.color, CV_8UC3)) {
    throw Error(
        fmt::format("frame {} is no {}x{} set of 8-bit color, 8-bit gray and float depth images",
                    frame.index, camera_.width, camera_.height),
        "Slam::push", "make the camera's width and height those of the images");
  }
  if (!records_.empty() &&
      (frame.index <= records_.back().index || frame.timestamp <= records_.back().timestamp)) {
    throw Error(
        fmt::format("frame {} at {:.6f} s does not come after frame {} at {:.6f} s", frame.index,
                    frame.timestamp, records_.back().index, records_.back().timestamp),
        "Slam::push", "push frames in the order of their stamps, each once");
  }
}

/// @param busy milliseconds that the frame kept the tracker from taking another
void Slam::shed_load(const RgbdFrame& image, double busy) {
  const int wanted = keypoint_budget_.keypoints();
  if (wanted < options_.orb.keypoints) ++load_shedding_.frames_of_fewer_keypoints;
  load_shedding_.fewest_keypoints =
      records_.empty() ? wanted : std::min(load_shedding_.fewest_keypoints, wanted);
  if (!records_.empty()) {
    keypoint_budget_.took(busy, 1000 * (image.timestamp - records_.back().timestamp),
                          newest_->inliers);
  }
}

/// Keyframes, now and then a frame between them, and that all has moved.
void Slam::show_dense_map(const MapView& map, const DetectedObjects& found) {
  if (!options_.dense_cloud || !extend_) return;
  DenseTask task;
  if (!map.found || newest_->relocalized) task.moved = map.moved;
  if (newest_->T_world_camera) add_frame(found, task);
  if (task.image || task.moved) dense_stage_->push(std::move(task));
}

void Slam::add_frame(const DetectedObjects& found, DenseTask& task) {
  const Frame& frame = *newest_->frame;
  const bool other_world = newest_->enters_world();
  const bool keyframe = newest_->proposal.has_value();
  const auto every = static_cast<std::size_t>(options_.dense.every);
  const bool due = every > 0 && frame.index() >= last_dense_ + every;
  const std::size_t waiting = options_.schedule.realtime() ? dense_stage_->waiting() : 0;
  if (!keyframe && !other_world && (!due || waiting > 2)) return;
  if (!other_world &&
      waiting + 4 > kLongQueue) {  // rather a hole in the map than a camera that waits for it
    ++load_shedding_.frames_without_view;
    return;
  }
  last_dense_ = frame.index();
  task.image = frame.image;
  task.movers = traced("mover pixels", [&] { return mover_pixels(frame, options_.dense.movers); });
  task.T_world_camera = *newest_->T_world_camera;
  task.place = {newest_->reference, newest_->T_reference_camera};
  task.found = found;
  task.keyframe = keyframe;
  task.other_world = other_world;
}

void Slam::work_on_dense_map(const DenseTask& task) {
  if (task.image) trace_frame(task.image->index);
  if (task.other_world) dense_.leave_world();
  if (task.moved) move_dense_map(*task.moved);
  if (task.image) add_to_dense_map(task);
}

void Slam::add_to_dense_map(const DenseTask& task) {
  SegmentedFrame things;
  {
    const TimedScope timed(dense_timing_, "dense map: labels");
    things = objects_in(task.found, *task.image, options_);
  }
  const std::uint64_t id = loaded_views_ + task.image->index;
  const TimedScope timed(dense_timing_,
                         task.keyframe ? "dense map: keyframe" : "dense map: other frame");
  if (task.keyframe) {
    view_places_[id] = task.place;
    dense_.add(id, *task.image, task.movers, task.T_world_camera, &things);
  } else if (dense_.add_if_new(id, *task.image, task.movers, task.T_world_camera, &things)) {
    view_places_[id] = task.place;
  }
}

void Slam::move_dense_map(const KeyframePoses& moved) {
  const TimedScope timed(dense_timing_, "dense map: all placed anew");
  dense_.follow([&](std::uint64_t id) -> std::optional<Pose> {
    ViewPlace place = view_places_.at(id);
    const auto own = moved.made_of.find(id - loaded_views_);
    if (id >= loaded_views_ && own != moved.made_of.end()) place = {own->second, Pose()};
    const auto found = moved.T_world_camera.find(place.keyframe);
    if (found == moved.T_world_camera.end()) return std::nullopt;
    return found->second * place.T_keyframe_view;
  });
}

void Slam::record(const TrackedFrame& tracked, double milliseconds) {
  const Frame& frame = *tracked.frame;
  FrameRecord record;
  record.index = frame.index();
  record.timestamp = frame.timestamp();
  record.state = tracked.state;
  record.reason = tracked.reason;
  record.reference = tracked.reference;
  record.T_reference_camera = tracked.T_reference_camera;
  record.keypoints = static_cast<int>(frame.features->size());
  record.moving_keypoints = static_cast<int>(
      std::count(frame.evidence.weight.begin(), frame.evidence.weight.end(), 0.0F));
  record.inliers = tracked.inliers;
  if (frame.instances) record.mask_age = static_cast<int>(frame.instances->age());
  record.relocalized = tracked.relocalized;
  record.tracked_by_odometry = tracked.tracked_by_odometry;
  record.keyframe = tracked.proposal.has_value() && extend_;
  record.milliseconds = milliseconds;
  records_.push_back(record);
}

/// The keyframe that a frame's place is known by: its own if it was kept; invalid where the frame
/// has no pose, or its map was dropped.
KeyframeId Slam::reference_of(const FrameRecord& record) const {
  if (!record.has_pose()) return {};
  const KeyframeId own = mapping_.keyframe_of(record.index);
  const KeyframeId reference = own.valid() ? own : record.reference;
  return mapping_.map().current_keyframe(reference).valid() ? reference : KeyframeId{};
}

/// A frame of the lost camera was recognized, and a later one agrees: it has a pose after all.
void Slam::record(const RelocalizationResult& confirmed) {
  const auto lost = std::find_if(records_.rbegin(), records_.rend(), [&](const FrameRecord& r) {
    return r.index == confirmed.frame->index();
  });
  if (lost == records_.rend()) return;
  lost->state = TrackState::kTracking;
  lost->reason.clear();
  lost->tracked_by_odometry = false;
  lost->reference = confirmed.local_map->reference;
  lost->T_reference_camera = confirmed.T_reference_camera;
  lost->inliers = confirmed.inliers;
}

/// A frame that was kept stands where its keyframe stands now; any other one where it stood beside
/// its reference.
std::optional<Pose> Slam::final_pose(const FrameRecord& record) const {
  const KeyframeId reference = reference_of(record);
  if (!reference.valid()) return std::nullopt;
  const bool own = reference != record.reference;
  return mapping_.map().resolve(reference, own ? Pose() : record.T_reference_camera);
}

/// Of several maps, those that held the camera for moments only.
void Slam::drop_brief_maps() {
  const Map& map = mapping_.map();
  std::map<std::uint32_t, int> frames;
  for (const FrameRecord& record : records_) {
    const KeyframeId reference = reference_of(record);
    if (reference.valid()) ++frames[map.at(map.current_keyframe(reference)).component];
  }
  for (const auto& [component, count] : frames) {
    if (frames.size() > 1 && count < options_.tracker.min_map_frames) mapping_.drop(component);
  }
}

/// A view stands where the keyframe of its frame stands now, else beside the one that its frame was
/// tracked by, or that it was loaded with: beside that one's heir, where it was erased.
std::optional<Slam::ViewPlace> Slam::place_of_view(std::uint64_t id) const {
  const KeyframeId own =
      id < loaded_views_ ? KeyframeId{} : mapping_.keyframe_of(id - loaded_views_);
  ViewPlace place = own.valid() ? ViewPlace{own, Pose()} : view_places_.at(id);
  const Map& map = mapping_.map();
  const KeyframeId current = map.current_keyframe(place.keyframe);
  if (!current.valid()) return std::nullopt;
  if (current == place.keyframe) return place;
  const Pose T_world_view = map.resolve(place.keyframe, place.T_keyframe_view);
  return ViewPlace{current, map.at(current).T_world_camera.inverse() * T_world_view};
}

/// Those of the largest of the unconnected maps.
ViewPoses Slam::dense_poses() const {
  const Map& map = mapping_.map();
  std::map<std::uint32_t, ViewPoses> by_component;
  for (const auto& [id, view] : dense_.views()) {
    const auto place = place_of_view(id);
    if (!place) continue;
    const Keyframe& keyframe = map.at(place->keyframe);
    by_component[keyframe.component][id] = keyframe.T_world_camera * place->T_keyframe_view;
  }
  return largest_of(by_component);
}

SlamResult Slam::finish() {
  const TraceScope scope("finish");
  instances_.finish();
  mapping_.drain();
  drop_brief_maps();
  mapping_.finish();
  dense_stage_->drain();
  movers_.finish();

  SlamResult result;
  std::map<std::size_t, Pose> pose_of;
  for (const FrameRecord& record : records_) {
    if (const auto T_world_camera = final_pose(record)) {
      result.trajectory.push_back({record.timestamp, *T_world_camera});
      pose_of.emplace(record.index, *T_world_camera);
    }
  }
  const Map& map = mapping_.map();
  map.for_each_keyframe([&](const Keyframe& k) {
    if (k.session == map.session()) result.keyframes.push_back({k.timestamp, k.T_world_camera});
  });
  std::sort(result.keyframes.begin(), result.keyframes.end(),
            [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });

  result.movers = movers_.tracks([&](std::size_t frame) -> std::optional<Pose> {
    const auto found = pose_of.find(frame);
    return found == pose_of.end() ? std::nullopt : std::optional(found->second);
  });
  result.mover_statistics = movers_.statistics();
  {
    const TimedScope timed(dense_timing_, "dense composition");
    const ViewPoses poses = dense_poses();
    dense_.leave_world();  // the live map has done its work
    result.placed = dense_.place(pose_lookup(poses));
    result.dense = cloud_of(result.placed, options_.dense.semantics);
  }
  result.dense_statistics = dense_.statistics();
  result.frames = records_;
  result.landmarks = map.landmark_count();
  result.maps = map.components().size();
  result.events = mapping_.events();
  result.refined = mapping_.refined();
  result.segmented = instances_.segmented();
  result.load_shedding = load_shedding_;
  result.load_shedding.frames_without_movers = movers_.passed_over();
  result.timing = timing_;
  result.timing.merge(instances_.timing());
  result.timing.merge(mapping_.timing());
  result.timing.merge(dense_timing_);
  result.timing.merge(movers_.timing());
  return result;
}

SavedMap Slam::saved_map(const std::string& writer) const {
  const Map& map = mapping_.map();
  SavedMap saved{writer, map.content(), {}};
  std::map<KeyframeId, std::uint32_t> number;  // in the content
  map.for_each_keyframe(
      [&](const Keyframe& k) { number.emplace(k.id, static_cast<std::uint32_t>(number.size())); });
  for (const auto& [id, view] : dense_.views()) {
    const auto place = place_of_view(id);
    if (!place) continue;
    saved.views.push_back({{number.at(place->keyframe), 0}, place->T_keyframe_view, *view});
  }
  return saved;
}

}  // namespace stillmap
