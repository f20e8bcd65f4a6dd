// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/slam_parameters.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/segment/coco.hpp"

#include <algorithm>
#include <limits>

namespace stillmap {
namespace {

/// Truncation distance of the mesh's signed distances [voxels], as usual for KinectFusion (Newcombe
/// et al., ISMAR 2011).
constexpr double kMeshTruncation = 4;
/// Largest relative depth step if depth edges get no special treatment, as in the papers.
constexpr double kAnyJump = std::numeric_limits<double>::infinity();

/// Standard deviation of the disparity if it is weighted like u and v, as in ORB-SLAM [pixels].
constexpr double kPixelSigma = 1;

/// Number of landmarks that ORB-SLAM2 and 3 create from depth if fewer keypoints are near.
constexpr std::size_t kFewestDepthLandmarks = 100;

/// Share of the memory limit for keyframes: about the ratio of the features of a keyframe to the
/// pixels of its view.
constexpr std::uint64_t kKeyframeShare = 6;

std::uint64_t memory_limit(const Options::Dense& dense) {
  return static_cast<std::uint64_t>(dense.memory) * 1000000;
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

void set_features(const Options::Features& from, OrbOptions& to) {
  to.keypoints = from.keypoints;
  to.levels = from.levels;
  to.scale_factor = from.scale_factor;
  to.fast_threshold = from.fast_threshold;
}

void set_network(const Options::Network& from, SlamParameters& to) {
  to.segment.model = from.model;
  to.segment.masks = from.masks;
  to.segment.backend = from.backend;
  to.segment.device = from.device;
  to.segment.threads = from.threads;
  to.segment.confidence = static_cast<float>(from.confidence);
  to.schedule.segment_every = from.every;
  to.schedule.mask_delay = from.mask_delay;
  to.schedule.max_mask_age = from.max_mask_age;
}

BoxBody body_named(const std::string& name) {
  if (name == "depth") return BoxBody::kDepthCluster;
  return name == "none" ? BoxBody::kNone : BoxBody::kMoved;
}

void set_motion(const Options::Motion& from, MotionOptions& to) {
  to.cues = from.cues;
  to.semantic.classes.dynamic = from.moving_classes;
  to.box_flow.classes = {from.moving_classes, from.potential_classes};
  to.epipolar.classes = {from.moving_classes, from.potential_classes};
  to.semantic.dilation = from.mask_dilation;
  to.semantic.prior = from.semantic_prior;
  to.box_flow.factor = from.box_flow_threshold;
  to.box_flow.body = body_named(from.box_flow_body);
  to.gate.in_se2 = from.gate_transform == "se2";
  to.gate.warp_error = from.gate_warp_error;
  to.gate.marked_share = from.gate_marked_share;
  to.epipolar.threshold = from.epipolar_threshold;
}

void set_tracking(const Options::Tracking& from, TrackerOptions& to) {
  to.min_inliers = from.min_inliers;
  to.new_map.patience = from.new_map_after;
  to.keyframes.min_gap = from.keyframe_gap;
  to.keyframes.max_rotation = from.keyframe_rotation;
  to.keyframes.max_translation = from.keyframe_translation;
}

/// Turns off the extensions of ORB-SLAM that `names` does not contain.
void set_extensions(const std::vector<std::string>& names, SlamParameters& to) {
  const auto has = [&](const std::string& name) { return contains(names, name); };
  to.orb.subpixel = has("subpixel");
  if (!has("foreground-depth")) to.orb.depth_edge.relative = kAnyJump;
  if (!has("sensor-noise")) to.disparity_sigma = kPixelSigma;
  if (!has("sharp-keyframes")) to.tracker.keyframes.min_sharpness = 0;
  if (!has("three-views")) to.tracker.keyframes.min_views = 2;
  if (!has("far-landmarks")) {  // all depths of the first keyframe (ORB-SLAM2, section III.C)
    to.mapper.max_first_landmark_sigma = std::numeric_limits<double>::infinity();
    to.mapper.max_landmark_sigma = kNearSigma;
    to.mapper.fewest_depth_landmarks = kFewestDepthLandmarks;
  }
  to.tracker.previous_frame_points = has("previous-frame-points");
  to.tracker.compensate_exposure = has("exposure");
  to.tracker.statistics.occlusion_test = has("occlusion");
  to.tracker.consistency_test = has("consistency");
  to.tracker.tracked_by_odometry = has("odometry");
  to.tracker.gyroscope = has("gyroscope");
  to.tracker.dead_reckoning = has("dead-reckoning");
  to.tracker.rest = has("rest");
  to.mapper.remove_depth_error = has("depth-error");
}

void set_map(const Options::Map& from, SlamParameters& to) {
  to.mapper.local_window = from.local_window;
  to.mapper.fusion_keyframes = from.fusion_keyframes;
  to.tracker.erase_seen_through = contains(from.landmark_rules, "seen-through");
  to.tracker.statistics.seen_through = to.tracker.erase_seen_through;
  if (contains(from.landmark_rules, "repeated")) to.tracker.repeats = RepeatRule::kMatched;
  if (contains(from.landmark_rules, "repeated-all-pairs"))
    to.tracker.repeats = RepeatRule::kAllPairs;
  to.places.loops = from.loops;
  to.final_adjustment = from.final_adjustment;
  to.smooth_trajectory = from.smooth_trajectory;
  to.tracker.filter_poses = from.smooth_trajectory;
}

void set_dense(const Options::Dense& from, DenseOptions& to) {
  to.voxel = from.voxel;
  to.back_projection.stride = from.stride;
  to.back_projection.max_depth = from.max_depth;
  to.back_projection.mask_dilation = from.mask_dilation;
  to.far.max_sigma = from.far_sigma;
  to.every = from.every;
  to.evidence.remove_ghosts = from.method == "votes";
  to.evidence.interpolate = from.method == "votes";
  to.fuse = from.method == "votes" && from.every > 0;
  to.registration = from.method == "registered";
  if (from.method != "votes") to.back_projection.max_jump = kAnyJump;
  to.memory.limit = memory_limit(from) - memory_limit(from) / kKeyframeShare;
  if (from.outlier_deviations > 0) to.outliers = {.deviations = from.outlier_deviations};
  to.movers = from.excluded_classes;
}

void set_outputs(const Options::Outputs& from, DenseOptions& to) {
  to.mesh.voxel = from.mesh_voxel;
  to.mesh.truncation = kMeshTruncation * from.mesh_voxel;
  to.occupancy.cell = from.planner_cell;
  to.occupancy.lowest = from.planner_lowest;
  to.occupancy.highest = from.planner_highest;
}

void set_schedule(const Options& from, ScheduleOptions& to) {
  to.realtime = from.realtime();
  to.insert_delay = from.schedule.insert_delay;
  to.refine_delay = from.schedule.refine_delay;
}

/// Throws Error for a class of an option that is not among the known ones.
void require_known(const std::vector<std::string>& classes, const std::string& option,
                   const std::vector<std::string>& known) {
  for (const std::string& name : classes) {
    if (contains(known, name)) continue;
    throw Error("there is no class '" + name + "'", "option " + option, suggestion(name, known));
  }
}

}  // namespace

SlamParameters parameters_of(const Options& options) {
  check_options(options);
  SlamParameters parameters;
  set_features(options.features, parameters.orb);
  parameters.tags = options.features.tags;
  set_network(options.network, parameters);
  set_motion(options.motion, parameters.motion);
  set_tracking(options.tracking, parameters.tracker);
  set_extensions(options.tracking.extensions, parameters);
  set_map(options.map, parameters);
  parameters.movers.enabled = options.movers.enabled;
  parameters.dense_cloud = options.dense.enabled;
  parameters.dense = dense_parameters_of(options);
  parameters.keyframe_memory = memory_limit(options.dense) / kKeyframeShare;
  set_schedule(options, parameters.schedule);
  return parameters;
}

DenseOptions dense_parameters_of(const Options& options) {
  check_options(options);
  DenseOptions parameters;
  set_dense(options.dense, parameters);
  set_outputs(options.outputs, parameters);
  return parameters;
}

void check_classes(const Options& options, const Detector* detector) {
  std::vector<std::string> known = coco_class_names();
  known.emplace_back("unknown");
  if (detector != nullptr) {
    const auto& names = detector->class_names();
    known.insert(known.end(), names.begin(), names.end());
  }
  require_known(options.motion.moving_classes, "motion.moving_classes", known);
  require_known(options.motion.potential_classes, "motion.potential_classes", known);
  require_known(options.dense.excluded_classes, "dense.excluded_classes", known);
}

}  // namespace stillmap
