// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/slam.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

const SlamOptions& checked(const SlamOptions& options) {
  check_options(options);
  return options;
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

std::vector<AnchoredView> views_to_begin_with(std::optional<StartingMap>& start) {
  return start ? std::move(start->saved.views) : std::vector<AnchoredView>();
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
      dense_(camera, options, extend_ && options.dense_cloud, views_to_begin_with(start)),
      movers_(options.movers, options.schedule.realtime()) {}

Slam::~Slam() = default;

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
  record(map.made);

  const auto initial = tracker_.predict_pose(*frame->features, map.local_map);
  const double following = watch.lap();

  MotionInput input{.image = image,
                    .features = frame->features,
                    .pyramid = options_.orb.pyramid(),
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
  dense_.push(newest_, seen.found, map);
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

/// A frame that became a keyframe stands where that keyframe stands.
void Slam::record(const std::vector<NewKeyframe>& made) {
  for (const NewKeyframe& keyframe : made) {
    const auto frame =
        std::lower_bound(records_.begin(), records_.end(), keyframe.frame_index,
                         [](const FrameRecord& r, std::size_t index) { return r.index < index; });
    frame->reference = keyframe.id;
    frame->T_reference_camera = Pose();
  }
}

/// False where the frame has no pose, or its map was dropped.
bool Slam::is_placed(const FrameRecord& record) const {
  return record.has_pose() && mapping_.map().current_keyframe(record.reference).valid();
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

std::optional<Pose> Slam::final_pose(const FrameRecord& record) const {
  if (!is_placed(record)) return std::nullopt;
  return mapping_.map().resolve(record.reference, record.T_reference_camera);
}

/// Of several maps, those that held the camera for moments only.
void Slam::drop_brief_maps() {
  const Map& map = mapping_.map();
  std::map<std::uint32_t, int> frames;
  for (const FrameRecord& record : records_) {
    if (is_placed(record)) ++frames[map.at(map.current_keyframe(record.reference)).component];
  }
  for (const auto& [component, count] : frames) {
    if (frames.size() > 1 && count < options_.tracker.min_map_frames) mapping_.drop(component);
  }
}

SlamResult Slam::finish() {
  const TraceScope scope("finish");
  instances_.finish();
  const std::vector<NewKeyframe> made = mapping_.drain();
  record(made);
  drop_brief_maps();
  mapping_.finish();
  dense_.finish(made);
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
  result.placed = dense_.place(map);
  result.dense = cloud_of(result.placed, options_.dense.semantics);
  result.dense_statistics = dense_.statistics();
  result.frames = records_;
  result.landmarks = map.landmark_count();
  result.maps = map.components().size();
  result.events = mapping_.events();
  result.refined = mapping_.refined();
  result.segmented = instances_.segmented();
  result.load_shedding = load_shedding_;
  result.load_shedding.frames_without_view = dense_.frames_left_out();
  result.load_shedding.frames_without_movers = movers_.passed_over();
  result.timing = timing_;
  result.timing.merge(instances_.timing());
  result.timing.merge(mapping_.timing());
  result.timing.merge(dense_.timing());
  result.timing.merge(movers_.timing());
  return result;
}

SavedMap Slam::saved_map(const std::string& writer) const {
  const Map& map = mapping_.map();
  return {writer, map.content(), dense_.saved_views(map)};
}

}  // namespace stillmap
