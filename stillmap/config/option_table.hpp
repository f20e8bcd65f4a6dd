// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"
#include "stillmap/tag/tag_detector.hpp"

#include <string>
#include <utility>
#include <vector>

namespace stillmap {

/// Range of a number, both ends included.
struct OptionRange {
  double lowest = 0, highest = 0;
};

/// Description of one option. Type, default and value are those of its member of Options.
struct OptionInfo {
  std::string path;      ///< Group and name: "group.name".
  std::string unit;      ///< Unit of the value; empty: none.
  OptionRange range;     ///< Range of a number.
  std::string sentence;  ///< Meaning of the option; also its comment in options.hpp.
  /// Accepted words of a text or of the items of a list; empty: any.
  std::vector<std::string> words = {};
};

/// Number of frames above every recording, for options without a natural upper bound.
constexpr double kManyFrames = 1e6;

template <typename Group, typename Visitor>
void visit_input_options(Group& input, const Visitor& visit) {
  visit({"input.first",
         "frames",
         {0, kManyFrames},
         "Number of frames skipped at the start of the recording."},
        input.first);
  visit({"input.count",
         "frames",
         {0, kManyFrames},
         "Maximum number of frames used, counted before the stride; 0 uses all."},
        input.count);
  visit({"input.stride", "frames", {1, 1000}, "Every n-th frame is used."}, input.stride);
  visit({"input.half_size", "", {}, "Whether images are processed at half their width and height."},
        input.half_size);
}

template <typename Group, typename Visitor>
void visit_features_options(Group& features, const Visitor& visit) {
  visit({"features.keypoints",
         "",
         {50, 10000},
         "Maximum number of keypoints per image, over all pyramid levels."},
        features.keypoints);
  visit({"features.levels", "", {1, 16}, "Number of levels of the scale pyramid."},
        features.levels);
  visit(
      {"features.scale_factor", "", {1.05, 2}, "Scale factor between neighboring pyramid levels."},
      features.scale_factor);
  visit({"features.fast_threshold",
         "gray levels",
         {7, 254},
         "FAST corner threshold; cells without such a corner are searched again with threshold 7."},
        features.fast_threshold);
  std::vector<std::string> tags = tag_family_names();
  tags.insert(tags.begin(), "none");
  visit({"features.tags",
         "",
         {},
         "Family of AprilTags whose corners are landmarks; a tag must not be moved, nor be there "
         "twice.",
         std::move(tags)},
        features.tags);
}

template <typename Group, typename Visitor>
void visit_network_options(Group& network, const Visitor& visit) {
  visit({"network.model",
         "",
         {},
         "Network (.onnx) for detection or segmentation, such as YOLO or RF-DETR; empty for "
         "none."},
        network.model);
  visit({"network.masks",
         "",
         {},
         "Folder with one mask (8-bit PNG) per frame, used instead of a network; empty for none."},
        network.masks);
  visit({"network.backend",
         "",
         {},
         "Inference library; auto takes the fastest one that is installed.",
         {"auto", "openvino", "onnxruntime", "opencv"}},
        network.backend);
  visit({"network.device",
         "",
         {},
         "Device of the network; auto takes the first of these that works, and cpu otherwise.",
         {"auto", "tensorrt", "cuda", "intel-gpu", "npu", "cpu"}},
        network.device);
  visit({"network.threads", "", {1, 256}, "Number of threads of the network."}, network.threads);
  visit({"network.confidence", "", {0.001, 1}, "Detections of lower confidence are dropped."},
        network.confidence);
  visit(
      {"network.every",
       "frames",
       {0, 1000},
       "The network runs on every n-th frame; in realtime it runs on at most every n-th. 0 means 1 "
       "on the devices cuda and tensorrt, and 3 on others."},
      network.every);
  visit({"network.mask_delay",
         "frames",
         {-1, 1000},
         "Number of frames after which the masks of a frame reach the tracker (lockstep). With 0 "
         "the tracker waits for them in both schedules. -1 means 0 on the devices cuda and "
         "tensorrt, and 2 on others."},
        network.mask_delay);
  visit({"network.max_mask_age",
         "frames",
         {0, 1000},
         "Masks are propagated to newer frames up to this age."},
        network.max_mask_age);
}

/// The thresholds of the cues that follow the papers.
template <typename Group, typename Visitor>
void visit_paper_cue_options(Group& motion, const Visitor& visit) {
  visit({"motion.box_flow_threshold",
         "",
         {0, 100},
         "A keypoint moves if its optical flow differs from the mean background flow by more than "
         "this multiple of the mean flow's norm (cue box-flow)."},
        motion.box_flow_threshold);
  visit({"motion.box_flow_body",
         "",
         {},
         "Part of the box of a moving class whose keypoints are excluded without a test of their "
         "flow: memory (surfaces that moved in one of the last 10 frames), depth (the largest "
         "cluster of depths in the box) or none (cue box-flow).",
         {"memory", "depth", "none"}},
        motion.box_flow_body);
  visit({"motion.gate_transform",
         "",
         {},
         "Image transformation that predicts the keypoints from the previous frame: homography, "
         "or se2, the rotation and translation in the image nearest to it (cue gated-semantic).",
         {"homography", "se2"}},
        motion.gate_transform);
  visit({"motion.gate_warp_error",
         "pixels",
         {0, 100},
         "A keypoint is marked if the transformation between two frames misses it by this or more "
         "(cue gated-semantic)."},
        motion.gate_warp_error);
  visit({"motion.gate_marked_share",
         "",
         {0, 1},
         "A frame is marked if more than this share of its keypoints is (cue gated-semantic)."},
        motion.gate_marked_share);
  visit({"motion.epipolar_threshold",
         "pixels",
         {0, 100},
         "A keypoint moves if it is farther than this from its epipolar line (cue epipolar)."},
        motion.epipolar_threshold);
}

template <typename Group, typename Visitor>
void visit_motion_options(Group& motion, const Visitor& visit) {
  visit({"motion.cues",
         "",
         {},
         "Motion cues that are combined, in this order; an empty list treats the world as static.",
         {"residual", "free-space", "surface", "history", "semantic", "box-flow", "gated-semantic",
          "epipolar", "epipolar-everywhere"}},
        motion.cues);
  visit({"motion.moving_classes",
         "",
         {},
         "Classes of objects that move by themselves; \"unknown\" is the class of mask folders."},
        motion.moving_classes);
  visit({"motion.potential_classes",
         "",
         {},
         "Classes of objects that may be moved by somebody and are tested by the cues box-flow and "
         "epipolar."},
        motion.potential_classes);
  visit({"motion.mask_dilation",
         "pixels",
         {0, 100},
         "Masks are grown by this margin before keypoints are looked up in them, where no cue "
         "judges whole surfaces."},
        motion.mask_dilation);
  visit({"motion.semantic_prior",
         "",
         {0, 100},
         "Log-odds against \"static\" of a detection of confidence 1, where a cue also measures "
         "the motion of surfaces."},
        motion.semantic_prior);
  visit_paper_cue_options(motion, visit);
}

template <typename Group, typename Visitor>
void visit_tracking_options(Group& tracking, const Visitor& visit) {
  visit(
      {"tracking.min_inliers",
       "",
       {6, 10000},
       "Number of landmarks from which a pose needs no further support; with fewer, points of the "
       "previous frame must agree with it."},
      tracking.min_inliers);
  visit(
      {"tracking.extensions",
       "",
       {},
       "Steps beyond ORB-SLAM: subpixel (corners are refined to sub-pixel accuracy), "
       "foreground-depth (a keypoint at a depth edge takes the depth of the nearer side), "
       "sensor-noise (depths are weighted by the noise model of the sensor instead of the pixel "
       "noise), previous-frame-points (points of the previous frame that are no landmarks support "
       "poses with few landmarks), exposure (keypoints are corrected for the camera's motion "
       "during the exposure), occlusion (landmarks behind a nearer surface do not count as "
       "missed), consistency (poses that contradict the motion of the camera give no keyframe), "
       "sharp-keyframes (blurred frames give no keyframe), three-views (a frame is compared with "
       "the landmarks of the reference keyframe that three keyframes observe, not two), "
       "far-landmarks (landmarks are created from depths up to twice as far), odometry (tracking "
       "continues by visual odometry outside a map that is not extended), gyroscope (rotations "
       "by the gyroscope of the camera's IMU support poses, if it has one), dead-reckoning "
       "(IMU and wheels give the pose of a lost camera), rest (a camera on a tripod keeps its "
       "pose) and depth-error (the smooth error of the depth sensor is estimated in the first "
       "keyframes and removed).",
       {"subpixel", "foreground-depth", "sensor-noise", "previous-frame-points", "exposure",
        "occlusion", "consistency", "sharp-keyframes", "three-views", "far-landmarks", "odometry",
        "gyroscope", "dead-reckoning", "rest", "depth-error"}},
      tracking.extensions);
  visit({"tracking.new_map_after",
         "frames",
         {0, kManyFrames},
         "Number of frames without a pose after which a new map is started."},
        tracking.new_map_after);
  visit({"tracking.keyframe_gap",
         "frames",
         {0, 1000},
         "Minimum number of frames between two keyframes."},
        tracking.keyframe_gap);
  visit({"tracking.keyframe_rotation",
         "degrees",
         {1, 180},
         "A keyframe is added at a rotation beyond this from every keyframe nearby."},
        tracking.keyframe_rotation);
  visit({"tracking.keyframe_translation",
         "",
         {0.01, 10},
         "A keyframe is added at a distance beyond this share of the median depth from every "
         "keyframe nearby."},
        tracking.keyframe_translation);
}

template <typename Group, typename Visitor>
void visit_map_options(Group& map, const Visitor& visit) {
  visit({"map.local_window",
         "keyframes",
         {1, 200},
         "Maximum number of keyframes that a local bundle adjustment moves."},
        map.local_window);
  visit({"map.fusion_keyframes",
         "keyframes",
         {0, 100},
         "Number of covisible keyframes with which the landmarks of a new keyframe are fused; 0 "
         "turns fusion off."},
        map.fusion_keyframes);
  visit({"map.landmark_rules",
         "",
         {},
         "Rules that erase landmarks in addition to those of ORB-SLAM: seen-through (the depth "
         "image sees through them, so their surface has left; also all landmarks of a map that "
         "was started on moving objects), repeated (equation 9 of the paper of preset gated-seg, "
         "over matched landmarks) and repeated-all-pairs (the same over all pairs in a vocabulary "
         "node).",
         {"seen-through", "repeated", "repeated-all-pairs"}},
        map.landmark_rules);
  visit({"map.loops", "", {}, "Whether loops are closed and maps are merged."}, map.loops);
  visit({"map.final_adjustment",
         "",
         {},
         "Whether global bundle adjustment is applied at the end of a run, and all frames are "
         "tracked again in its map."},
        map.final_adjustment);
  visit(
      {"map.smooth_trajectory",
       "",
       {},
       "Whether poses are smoothed with noise levels estimated from the run: those returned during "
       "the run by the frames before, the trajectory at its end by all frames."},
      map.smooth_trajectory);
}

template <typename Group, typename Visitor>
void visit_movers_options(Group& movers, const Visitor& visit) {
  visit({"movers.enabled",
         "",
         {},
         "Whether moving objects are detected and tracked in the world frame."},
        movers.enabled);
}

template <typename Group, typename Visitor>
void visit_dense_options(Group& dense, const Visitor& visit) {
  visit({"dense.enabled", "", {}, "Whether the dense map is made."}, dense.enabled);
  visit({"dense.voxel", "m", {0.001, 1}, "Side of the voxels of the dense cloud."}, dense.voxel);
  visit({"dense.stride",
         "pixels",
         {1, 32},
         "Every n-th pixel of a view is used, in both directions."},
        dense.stride);
  visit({"dense.max_depth",
         "m",
         {0, 1000},
         "Larger depths are left out, except on far surfaces; 0 leaves out depths whose standard "
         "deviation is larger than that of a Kinect v1 at 4 m."},
        dense.max_depth);
  visit({"dense.far_sigma",
         "m",
         {0, 1},
         "Smooth surfaces are averaged and used up to this standard deviation of a depth; 0 leaves "
         "far surfaces out. The default is that of a Kinect v1 at 5 m."},
        dense.far_sigma);
  visit({"dense.every",
         "frames",
         {0, kManyFrames},
         "A frame that is no keyframe is considered after this many frames; 0 uses keyframes only, "
         "without averaging of depths."},
        dense.every);
  visit({"dense.method",
         "",
         {},
         "Way of making the dense map: votes (depths are averaged, and voxels that other views see "
         "through are removed), "
         "keyframes (the clouds of the keyframes are stitched, as in the papers) or registered "
         "(each cloud is first registered to those before it by ICP).",
         {"votes", "keyframes", "registered"}},
        dense.method);
  visit({"dense.memory",
         "MB",
         {0, 1e6},
         "Memory for the views of the dense map (five sixths) and the features of keyframes; those "
         "not used for the longest time are kept in temporary files without a name, by default in "
         "the folder of the results. The map does not depend on it."},
        dense.memory);
  visit({"dense.outlier_deviations",
         "",
         {0, 100},
         "Points are dropped whose distance to their neighbors exceeds the mean by this many "
         "standard deviations; 0 keeps all points."},
        dense.outlier_deviations);
  visit({"dense.mask_dilation",
         "pixels",
         {0, 100},
         "Masks of excluded objects are grown by this margin."},
        dense.mask_dilation);
  visit({"dense.excluded_classes",
         "",
         {},
         "Classes of objects that are left out of the dense map, whether they move or not."},
        dense.excluded_classes);
}

template <typename Group, typename Visitor>
void visit_outputs_options(Group& outputs, const Visitor& visit) {
  visit({"outputs.mesh_voxel", "m", {0.002, 1}, "Side of the voxels of the mesh."},
        outputs.mesh_voxel);
  visit({"outputs.planner_cell", "m", {0.005, 1}, "Side of the cells of the occupancy grids."},
        outputs.planner_cell);
  visit({"outputs.planner_lowest",
         "m",
         {0, 100},
         "Lower end of the height band of the floor plan, above the floor."},
        outputs.planner_lowest);
  visit({"outputs.planner_highest",
         "m",
         {0, 100},
         "Upper end of the height band of the floor plan, above the floor."},
        outputs.planner_highest);
}

template <typename Group, typename Visitor>
void visit_schedule_options(Group& schedule, const Visitor& visit) {
  visit({"schedule.mode",
         "",
         {},
         "lockstep uses each result at a fixed later frame, so that runs are repeatable; realtime "
         "uses it as soon as it is ready.",
         {"lockstep", "realtime"}},
        schedule.mode);
  visit({"schedule.insert_delay",
         "frames",
         {1, 1000},
         "Number of frames after which the landmarks of a new keyframe are visible (lockstep)."},
        schedule.insert_delay);
  visit({"schedule.refine_delay",
         "frames",
         {1, 1000},
         "Number of frames after which the refined map around a new keyframe is visible "
         "(lockstep)."},
        schedule.refine_delay);
}

/// Calls visitor(const OptionInfo&, Member&) for every option, in the order of the documentation.
/// This is the only list of options: reading, checking, writing and documentation all use it.
/// @param options  Options or const Options
template <typename AnyOptions, typename Visitor>
void visit_options(AnyOptions& options, Visitor&& visitor) {
  // With a parameter of a named type, the functions above can give an OptionInfo as a braced list.
  const auto visit = [&](const OptionInfo& info, auto& member) { visitor(info, member); };
  visit_input_options(options.input, visit);
  visit_features_options(options.features, visit);
  visit_network_options(options.network, visit);
  visit_motion_options(options.motion, visit);
  visit_tracking_options(options.tracking, visit);
  visit_map_options(options.map, visit);
  visit_movers_options(options.movers, visit);
  visit_dense_options(options.dense, visit);
  visit_outputs_options(options.outputs, visit);
  visit_schedule_options(options.schedule, visit);
}

}  // namespace stillmap
