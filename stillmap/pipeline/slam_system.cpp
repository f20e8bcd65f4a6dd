// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/slam_system.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/span_names.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/tag_corners.hpp"
#include "stillmap/optimize/trajectory_smoother.hpp"
#include "stillmap/pipeline/camera_check.hpp"
#include "stillmap/pipeline/snapshot.hpp"
#include "stillmap/sensor/require_image.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kWhere = "Slam::push";  // the place that errors of a frame name

/// Replaces the poses whose timestamps are in another trajectory; both by ascending timestamps.
void replace_poses(const Trajectory& by, Trajectory& trajectory) {
  auto other = by.begin();
  for (StampedPose& pose : trajectory) {
    while (other != by.end() && other->timestamp < pose.timestamp) ++other;
    if (other != by.end() && other->timestamp == pose.timestamp) pose = *other;
  }
}

bool extends(const std::optional<StartingMap>& start) { return !start || start->extend; }

TrackerStart how_to_begin(const std::optional<StartingMap>& start) {
  if (!start) return TrackerStart::kNewMap;
  return start->extend ? TrackerStart::kInMap : TrackerStart::kInMapOnly;
}

Camera with_disparity_sigma(Camera camera, double sigma) {
  camera.disparity_sigma = sigma;
  return camera;
}

OrbOptions with_depth_noise(OrbOptions orb, const DepthSensor& sensor) {
  orb.depth_edge.noise = depth_edge_of(sensor).noise;
  return orb;
}

Map map_to_begin_in(std::optional<StartingMap>& start, const Camera& camera,
                    const PyramidShape& pyramid) {
  if (!start) return {camera, pyramid};
  MapContent map = map_for(std::move(start->saved.map), camera, pyramid, "the map to begin in");
  map.camera.disparity_sigma = camera.disparity_sigma;
  return Map(std::move(map));
}

std::vector<AnchoredView> views_to_begin_with(std::optional<StartingMap>& start) {
  return start ? std::move(start->saved.views) : std::vector<AnchoredView>();
}

std::optional<TagDetector> tag_detector(const std::string& family) {
  if (family == "none") return std::nullopt;
  return TagDetector(family);
}

}  // namespace

SlamSystem::SlamSystem(const Camera& camera, const SlamParameters& options,
                       std::unique_ptr<Detector> detector, std::optional<StartingMap> start)
    : own_trace_(bound_trace_track() != nullptr ? nullptr
                                                : std::make_unique<Trace>(TraceDetail::kTimes)),
      track_(own_trace_ ? own_trace_->add_track("camera") : *bound_trace_track()),
      first_track_(track_.trace().tracks().size()),
      construction_(std::in_place, &track_),
      options_(options),
      camera_(with_disparity_sigma(camera, options.disparity_sigma)),
      extractor_(with_depth_noise(options.orb, camera.depth_sensor)),
      tags_(tag_detector(options.tags)),
      keypoint_budget_(options.orb.keypoints),
      motion_(options.motion),
      tracker_(camera_, options.orb.pyramid(), options.tracker, how_to_begin(start)),
      instances_(std::move(detector), options),
      mapping_(map_to_begin_in(start, camera_, options.orb.pyramid()), options, extends(start)),
      dense_(camera_, options, extends(start), views_to_begin_with(start)),
      movers_(options.movers, options.schedule.realtime),
      log_(extends(start)),
      late_({options.keyframe_memory, options.dense.memory.folder}, camera.imu.has_value()) {
  construction_.reset();  // all threads have been made and have their tracks
  end_track_ = track_.trace().tracks().size();
}

SlamSystem::~SlamSystem() = default;

void SlamSystem::set_extend(bool extend) {
  tracker_.set_extend(extend);
  mapping_.set_extend(extend);
  dense_.set_extend(extend);
  log_.set_extend(extend);
}

std::string SlamSystem::load(SavedMap saved) {
  MapContent map = map_for(std::move(saved.map), camera_, options_.orb.pyramid(), "the loaded map");
  AddedMap added = mapping_.add(std::move(map), newest_ ? newest_->frame->index() : 0);
  for (AnchoredView& view : saved.views) view.anchor = added.keyframes.at(view.anchor.slot);
  std::erase_if(saved.views, [&](const AnchoredView& view) {  // of frames that have a view here
    return std::ranges::find(added.repeated, view.anchor, &RepeatedKeyframe::kept) !=
           added.repeated.end();
  });
  dense_.add(std::move(saved.views));
  return std::move(added.not_found);
}

std::optional<Pose> SlamSystem::push(const RgbdFramePtr& image) {
  check(image);
  const TraceBinding binding(&track_);
  trace_frame(image->index);
  traced(span::kFrame, [&] { track(image); });
  if (options_.schedule.realtime) shed_load(*image);
  log_.add(*newest_, tracking_times(propagation_));
  late_.add(*newest_);
  carried_.add({camera_, options_.orb.pyramid()}, newest_);
  return newest_->T_world_filtered();
}

/// The way of a frame. While the network's masks are propagated to it on their own threads, the
/// frame's features, its initial pose and the cues that need no masks are found. If no cue needs
/// the initial pose, the keypoints are labeled first, and moving ones are never matched.
void SlamSystem::track(const RgbdFramePtr& image) {
  auto frame = std::make_shared<Frame>();
  frame->image = image;
  frame->cells = std::make_shared<CellGrid>(image->depth, camera_);
  instances_.push(image, frame->cells);
  frame->recorded_features = std::make_shared<Features>(features_of(*image));

  view_ = mapping_.view_for(image->index);
  log_.settle(view_.made);
  tracker_.predict_motion(*image);
  tracker_.compensate_motion(*frame, std::nullopt, view_.local_map);
  std::optional<InitialPose> initial;
  const auto predict_pose = [&] {
    initial = tracker_.predict_pose(*frame->features, view_.local_map, frame->evidence.weight);
    if (initial) tracker_.compensate_motion(*frame, initial, view_.local_map);
  };
  if (motion_.needs_pose()) predict_pose();
  MotionEvidence evidence = motion_.begin(motion_input(*frame, initial));

  const FrameInstances known = instances_.wait();
  frame->instances = known.propagated;
  frame->instance_cells = known.propagated_cells;
  propagation_ = known.milliseconds;
  frame->evidence = motion_.finish(std::move(evidence), motion_input(*frame, initial));
  if (!motion_.needs_pose()) predict_pose();

  newest_ = tracker_.track(frame, initial, view_.local_map, view_.found);
  if (newest_->relocalized) {
    mapping_.accept_relocalization(*view_.found);
    log_.confirm(*view_.found);
  }
  mapping_.push(newest_);
  movers_.push(newest_);
  dense_.push(newest_, known.detected, view_);
}

Features SlamSystem::features_of(const RgbdFrame& image) {
  Features features =
      extractor_.extract(image.gray, image.depth, keypoint_budget_.keypoints(), image.ignored);
  if (!tags_) return features;
  const TraceScope scope(span::kFeatures);
  return with_tag_corners(std::move(features), tags_->detect(image.gray), image.depth,
                          image.ignored);
}

MotionInput SlamSystem::motion_input(const Frame& frame,
                                     const std::optional<InitialPose>& initial) const {
  // Earlier evidence was derived from the poses of a map that was replaced.
  const bool first_evidence = newest_ && newest_->proposal && newest_->proposal->replaced.valid();
  return {.image = frame.image,
          .features = frame.features,
          .pyramid = options_.orb.pyramid(),
          .cells = frame.cells,
          .exposure = frame.exposure,
          .instances = frame.instances,
          .instance_cells = frame.instance_cells,
          .previous = newest_ ? newest_->frame : nullptr,
          .ego_motion = initial && !first_evidence ? std::optional(initial->motion) : std::nullopt};
}

/// Masks are propagated while the tracker's thread does other work; the part that it has to wait
/// for counts as tracking. Waiting for the network and for the map does not: a live camera's
/// tracker takes what there is, and a recording's may run ahead of them.
/// @param propagation time that propagating the masks to the frame took [ms]
TrackingTimes SlamSystem::tracking_times(double propagation) const {
  const double features = track_.in_frame(span::kFeatures);
  const double initial_pose = track_.in_frame(span::kInitialPose);
  const double motion_before_masks = track_.in_frame(span::kMotionBeforeMasks);
  const double blocked = track_.in_frame(waiting_span(InstanceStream::kThread));
  const double masks =
      std::clamp(propagation - (features + initial_pose + motion_before_masks), 0.0, blocked);
  const double motion =
      track_.in_frame(span::kCells) + motion_before_masks + track_.in_frame(span::kMotion);
  return {.features = static_cast<float>(features),
          .masks = static_cast<float>(masks),
          .motion = static_cast<float>(motion),
          .pose = static_cast<float>(initial_pose + track_.in_frame(span::kPose)),
          .waiting = static_cast<float>(blocked - masks + track_.in_frame(span::kWaitingForMap))};
}

void SlamSystem::check(const RgbdFramePtr& frame) const {
  if (!frame) throw Error("the frame is null", kWhere, "push frames only");
  const auto require = [&](const cv::Mat& image, int type, const char* name, const char* fix) {
    require_size(image, camera_, name, kWhere);
    if (image.type() != type) refuse_type(image, name, kWhere, fix);
  };
  require(frame->color, CV_8UC3, "color image", "it must be 8-bit BGR");
  require(frame->gray, CV_8UC1, "gray image", "it must be 8-bit with one channel");
  require(frame->depth, CV_32FC1, "depth image", "it must be 32-bit float in meters");
  if (!frame->ignored.empty())
    require(frame->ignored, CV_8UC1, "image of ignored pixels", "it must be 8-bit, one channel");
  if (!std::isfinite(frame->timestamp)) {
    throw Error(fmt::format("the timestamp of frame {} is not finite", frame->index), kWhere,
                "give seconds");
  }
  if (log_.empty()) return;
  const FrameRecord& last = log_.back();
  if (frame->index > last.index && frame->timestamp > last.timestamp) return;
  throw Error(fmt::format("frame {} at {:.6f} s does not come after frame {} at {:.6f} s",
                          frame->index, frame->timestamp, last.index, last.timestamp),
              kWhere, "push frames in the order of their timestamps, each once");
}

/// For a camera that does not wait: fewer keypoints where frames keep the tracker too long.
void SlamSystem::shed_load(const RgbdFrame& image) {
  const int wanted = keypoint_budget_.keypoints();
  if (wanted < options_.orb.keypoints) ++load_shedding_.frames_of_fewer_keypoints;
  load_shedding_.fewest_keypoints =
      log_.empty() ? wanted : std::min(load_shedding_.fewest_keypoints, wanted);
  if (log_.empty()) return;
  keypoint_budget_.add_frame(track_.in_frame(span::kFrame),
                             1000 * (image.timestamp - log_.back().timestamp), newest_->inliers);
}

LoadShedding SlamSystem::load_shedding() const {
  LoadShedding shedding = load_shedding_;
  shedding.frames_without_view = dense_.frames_left_out();
  shedding.frames_without_movers = movers_.frames_skipped();
  return shedding;
}

std::shared_ptr<const Snapshot> SlamSystem::snapshot() {
  auto snapshot = std::make_shared<Snapshot>();
  const auto frames = std::make_shared<const LoggedFrames>(log_.copy());
  // Each thread contributes its part, all at the same time.
  auto map = mapping_.ask(
      [snapshot, frames](const MapMaker& maker) { add_map(maker, frames->placed, *snapshot); });
  auto movers = movers_.ask();
  auto cloud = dense_.ask();
  map.get();
  if (frames->final_poses) replace_poses(*frames->final_poses, snapshot->trajectory);
  snapshot->movers = moving_objects(movers.get());
  const std::shared_ptr<const LabeledCloud> labeled = cloud.get();
  snapshot->cloud = labeled->cloud;
  snapshot->cloud_voxels = {labeled, &labeled->voxels};
  if (frames->newest) snapshot->newest = pose_update(*frames->newest, *snapshot);
  return snapshot;
}

void SlamResult::set_poses(std::vector<UncertainPose> found) {
  poses = std::move(found);
  trajectory.clear();
  for (const UncertainPose& pose : poses)
    trajectory.push_back({pose.timestamp, pose.T_world_camera});
}

std::vector<UncertainPose> camera_poses(const FrameLog& log, const Map& map, bool smooth) {
  std::vector<UncertainPose> poses;
  for (const auto& path : log.paths(map)) {
    const auto part = smooth ? smooth_trajectory(path) : path;
    poses.insert(poses.end(), part.begin(), part.end());
  }
  return poses;
}

SlamResult SlamSystem::finish() {
  const TraceBinding binding(&track_);
  trace_no_frame();
  SlamResult result;
  traced("finish", [&] {
    finish_streams();
    traced("smoothing", [&] {
      result.set_poses(camera_poses(log_, mapping_.map(), options_.smooth_trajectory));
    });
    log_.set_final_poses(result.trajectory);
    result.keyframes = keyframe_trajectory();
    result.frames = log_.records_in(mapping_.map());
    result.up = upward(result.frames, result.trajectory);
    result.events = mapping_.events();
    collect_movers(result);
    result.frames_by_map = frames_by_component(result.frames);
    collect_dense_map(result);
    collect_statistics(result);
  });
  result.timing = stage_times();
  return result;
}

void SlamSystem::finish_streams() {
  instances_.finish();
  view_ = mapping_.drain();
  log_.settle(view_.made);
  drop_brief_maps();
  mapping_.finish();
  if (options_.final_adjustment) {
    late_.track_again({camera_, options_.orb.pyramid()}, mapping_.map(),
                      options_.tracker.min_inliers, log_);
  }
  dense_.finish(view_.made);
  movers_.finish();
}

/// Of several unconnected maps, those that held the camera for moments only.
void SlamSystem::drop_brief_maps() {
  const auto frames = frames_by_component(log_.records_in(mapping_.map()));
  for (const auto& [component, count] : frames) {
    if (frames.size() > 1 && count < kMinMapFrames) mapping_.drop(component);
  }
}

/// The keyframes of this run by their timestamps.
Trajectory SlamSystem::keyframe_trajectory() const {
  const Map& map = mapping_.map();
  Trajectory keyframes;
  map.for_each_keyframe([&](const Keyframe& k) {
    if (k.session == map.session()) keyframes.push_back({k.timestamp, k.T_world_camera});
  });
  std::sort(keyframes.begin(), keyframes.end(),
            [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return keyframes;
}

void SlamSystem::collect_movers(SlamResult& result) const {
  const std::map<std::size_t, Pose> pose_of = log_.poses(mapping_.map());
  result.movers = movers_.tracks([&](std::size_t frame) -> std::optional<Pose> {
    const auto found = pose_of.find(frame);
    return found == pose_of.end() ? std::nullopt : std::optional(found->second);
  });
  result.mover_statistics = movers_.statistics();
}

void SlamSystem::collect_dense_map(SlamResult& result) {
  const TraceScope scope(span::kDenseComposition);
  result.placed = dense_.place(mapping_.map(), result.frames_by_map);
  result.dense = cloud_of(result.placed);
  result.dense_statistics = dense_.statistics();
}

void SlamSystem::collect_statistics(SlamResult& result) const {
  const Map& map = mapping_.map();
  result.landmarks = map.landmark_count();
  result.maps = map.components().size();
  result.refined = mapping_.refined();
  result.segmented = instances_.segmented();
  result.detector = instances_.use();
  result.detector_failures = instances_.failures();
  result.detector_skipped = instances_.skipped();
  result.detector_finding = instances_.finding();
  result.carried_parts = carried_.finding();
  result.texture = mapping_.texture();
  result.motion_sensors = tracker_.findings();
  result.load_shedding = load_shedding();
  result.camera = camera_;
  result.shutter = tracker_.shutter();
  if (camera_.depth_sensor.principle != DepthPrinciple::kStereo)
    result.camera_errors = camera_errors(map);
}

/// All threads rest, so their tracks may be read.
StageTimes SlamSystem::stage_times() const {
  StageTimes times;
  log_.add_times_to(times);
  for (const std::string_view cue : motion_.cues())
    times.append(fmt::format("motion: {}", cue), track_.times(cue));
  const auto& tracks = track_.trace().tracks();
  for (const std::string_view stage : span::kStages) {
    times.append(stage, track_.times(stage));
    for (std::size_t i = first_track_; i < end_track_; ++i)
      times.append(stage, tracks[i].times(stage));
  }
  return times;
}

SavedMap SlamSystem::saved_map(const std::string& writer) {
  SavedMap saved{writer, {}, {}};
  mapping_
      .ask([&](const MapMaker& maker) {
        saved.map = maker.map().content();
        // The dense map's thread never waits for the map's, which waits for it here.
        dense_.ask([&](const DenseStream& dense) { saved.views = dense.saved_views(maker.map()); })
            .get();
      })
      .get();
  return saved;
}

}  // namespace stillmap
