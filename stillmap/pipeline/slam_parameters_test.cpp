// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/slam_parameters.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/config/option_values.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

SlamParameters parameters_of_preset(const std::string& name) {
  return parameters_of(read_options(name));
}

TEST(SlamParameters, OfEveryPresetMakeTheCuesThatItNames) {
  for (const Preset& preset : presets()) {
    const Options options = read_options(preset.name);
    const MotionCues cues = make_cues(parameters_of(options).motion);
    ASSERT_EQ(cues.size(), options.motion.cues.size()) << preset.name;
    for (std::size_t i = 0; i < cues.size(); ++i) {
      EXPECT_EQ(cues[i]->name(), options.motion.cues[i]) << preset.name;
    }
  }
}

TEST(SlamParameters, MakeEveryCueThatTheOptionsKnow) {
  Options options;
  visit_options(options, [](const OptionInfo& info, auto& cues) {
    if constexpr (is_list<std::decay_t<decltype(cues)>>) {
      if (info.path == "motion.cues") cues = info.words;
    }
  });
  EXPECT_EQ(make_cues(parameters_of(options).motion).size(), options.motion.cues.size());
  EXPECT_GE(options.motion.cues.size(), 8U);
}

/// The defaults are written twice: in the user's options, and in the parameters of each algorithm,
/// on which its tests rely.
TEST(SlamParameters, OfTheDefaultOptionsAreTheAlgorithmsDefaults) {
  const SlamParameters made = parameters_of(Options()), defaults;
  EXPECT_EQ(made.orb.keypoints, defaults.orb.keypoints);
  EXPECT_EQ(made.orb.levels, defaults.orb.levels);
  EXPECT_EQ(made.orb.scale_factor, defaults.orb.scale_factor);
  EXPECT_EQ(made.orb.fast_threshold, defaults.orb.fast_threshold);
  EXPECT_EQ(made.segment.backend, defaults.segment.backend);
  EXPECT_EQ(made.segment.threads, defaults.segment.threads);
  EXPECT_EQ(made.segment.confidence, defaults.segment.confidence);
  EXPECT_EQ(made.dense.memory.limit, defaults.dense.memory.limit);
  EXPECT_EQ(made.schedule.max_mask_age, defaults.schedule.max_mask_age);
  EXPECT_EQ(made.motion.cues, defaults.motion.cues);
  EXPECT_EQ(made.motion.semantic.classes.dynamic, defaults.motion.semantic.classes.dynamic);
  EXPECT_EQ(made.motion.semantic.dilation, defaults.motion.semantic.dilation);
  EXPECT_EQ(made.motion.semantic.prior, defaults.motion.semantic.prior);
  EXPECT_EQ(made.motion.box_flow.factor, defaults.motion.box_flow.factor);
  EXPECT_EQ(made.motion.box_flow.body, defaults.motion.box_flow.body);
  EXPECT_EQ(made.motion.gate.in_se2, defaults.motion.gate.in_se2);
  EXPECT_EQ(made.motion.gate.warp_error, defaults.motion.gate.warp_error);
  EXPECT_EQ(made.motion.gate.marked_share, defaults.motion.gate.marked_share);
  EXPECT_EQ(made.motion.epipolar.threshold, defaults.motion.epipolar.threshold);
  EXPECT_EQ(made.tracker.min_inliers, defaults.tracker.min_inliers);
  EXPECT_EQ(made.tracker.new_map.patience, defaults.tracker.new_map.patience);
  EXPECT_EQ(made.tracker.tracked_by_odometry, defaults.tracker.tracked_by_odometry);
  EXPECT_EQ(made.tracker.keyframes.min_gap, defaults.tracker.keyframes.min_gap);
  EXPECT_EQ(made.tracker.keyframes.max_rotation, defaults.tracker.keyframes.max_rotation);
  EXPECT_EQ(made.tracker.keyframes.max_translation, defaults.tracker.keyframes.max_translation);
  EXPECT_EQ(made.mapper.local_window, defaults.mapper.local_window);
  EXPECT_EQ(made.mapper.fusion_keyframes, defaults.mapper.fusion_keyframes);
  EXPECT_EQ(made.tracker.erase_seen_through, defaults.tracker.erase_seen_through);
  EXPECT_EQ(made.tracker.repeats, defaults.tracker.repeats);
  EXPECT_EQ(made.tracker.previous_frame_points, defaults.tracker.previous_frame_points);
  EXPECT_EQ(made.tracker.compensate_exposure, defaults.tracker.compensate_exposure);
  EXPECT_EQ(made.tracker.consistency_test, defaults.tracker.consistency_test);
  EXPECT_EQ(made.tracker.statistics.occlusion_test, defaults.tracker.statistics.occlusion_test);
  EXPECT_EQ(made.tracker.statistics.seen_through, defaults.tracker.statistics.seen_through);
  EXPECT_EQ(made.tracker.keyframes.min_sharpness, defaults.tracker.keyframes.min_sharpness);
  EXPECT_EQ(made.mapper.max_landmark_sigma, defaults.mapper.max_landmark_sigma);
  EXPECT_EQ(made.mapper.max_first_landmark_sigma, defaults.mapper.max_first_landmark_sigma);
  EXPECT_EQ(made.orb.subpixel, defaults.orb.subpixel);
  EXPECT_EQ(made.orb.depth_edge.relative, defaults.orb.depth_edge.relative);
  EXPECT_EQ(made.disparity_sigma, Camera().disparity_sigma);
  EXPECT_EQ(made.places.loops, defaults.places.loops);
  EXPECT_EQ(made.final_adjustment, defaults.final_adjustment);
  EXPECT_EQ(made.smooth_trajectory, defaults.smooth_trajectory);
  EXPECT_EQ(made.tracker.filter_poses, defaults.tracker.filter_poses);
  EXPECT_EQ(made.movers.enabled, defaults.movers.enabled);
  EXPECT_EQ(made.dense_cloud, defaults.dense_cloud);
  EXPECT_EQ(made.dense.voxel, defaults.dense.voxel);
  EXPECT_EQ(made.dense.back_projection.stride, defaults.dense.back_projection.stride);
  EXPECT_EQ(made.dense.back_projection.max_depth, defaults.dense.back_projection.max_depth);
  EXPECT_EQ(made.dense.back_projection.mask_dilation, defaults.dense.back_projection.mask_dilation);
  EXPECT_EQ(made.dense.far.max_sigma, defaults.dense.far.max_sigma);
  EXPECT_EQ(made.dense.every, defaults.dense.every);
  EXPECT_EQ(made.dense.evidence.remove_ghosts, defaults.dense.evidence.remove_ghosts);
  EXPECT_EQ(made.dense.registration, defaults.dense.registration);
  EXPECT_EQ(made.dense.back_projection.max_jump, defaults.dense.back_projection.max_jump);
  EXPECT_EQ(made.dense.outliers.deviations, defaults.dense.outliers.deviations);
  EXPECT_EQ(made.dense.outliers.neighbors, defaults.dense.outliers.neighbors);
  EXPECT_EQ(made.dense.movers, defaults.dense.movers);
  EXPECT_EQ(made.dense.mesh.voxel, defaults.dense.mesh.voxel);
  EXPECT_EQ(made.dense.mesh.truncation, defaults.dense.mesh.truncation);
  EXPECT_EQ(made.dense.occupancy.cell, defaults.dense.occupancy.cell);
  EXPECT_EQ(made.dense.occupancy.lowest, defaults.dense.occupancy.lowest);
  EXPECT_EQ(made.dense.occupancy.highest, defaults.dense.occupancy.highest);
  EXPECT_EQ(made.schedule.realtime, defaults.schedule.realtime);
  EXPECT_EQ(made.schedule.insert_delay, defaults.schedule.insert_delay);
  EXPECT_EQ(made.schedule.refine_delay, defaults.schedule.refine_delay);
  EXPECT_EQ(made.schedule.segment_every, defaults.schedule.segment_every);
  EXPECT_EQ(made.schedule.mask_delay, defaults.schedule.mask_delay);
}

TEST(SlamParameters, OfBoxPresetsListTheClassesOfTheirPapers) {
  const ClassSets indoor = indoor_classes();
  const ClassSets flow = parameters_of_preset("box-flow").motion.box_flow.classes;
  EXPECT_EQ(flow.dynamic, indoor.dynamic);
  EXPECT_EQ(flow.potential, indoor.potential);
  const ClassSets epipolar = parameters_of_preset("box-epipolar").motion.epipolar.classes;
  EXPECT_EQ(epipolar.dynamic, indoor.dynamic);
  EXPECT_EQ(epipolar.potential, indoor.potential);
}

TEST(SlamParameters, OfTheBaselineHaveNoExtensions) {
  const SlamParameters baseline = parameters_of_preset("orb-rgbd");
  EXPECT_FALSE(baseline.orb.subpixel);
  EXPECT_TRUE(std::isinf(baseline.orb.depth_edge.relative));
  EXPECT_EQ(baseline.disparity_sigma, 1);  // weighted as pixels are
  EXPECT_FALSE(baseline.tracker.previous_frame_points);
  EXPECT_FALSE(baseline.tracker.compensate_exposure);
  EXPECT_FALSE(baseline.tracker.consistency_test);
  EXPECT_FALSE(baseline.tracker.tracked_by_odometry);
  EXPECT_FALSE(baseline.tracker.statistics.occlusion_test);
  EXPECT_EQ(baseline.tracker.keyframes.min_sharpness, 0);
  EXPECT_EQ(baseline.mapper.max_landmark_sigma, kNearSigma);
}

TEST(SlamParameters, OneExtensionLeavesTheOthersOff) {
  Options options = read_options("orb-rgbd");
  options.tracking.extensions = {"occlusion"};
  const SlamParameters made = parameters_of(options);
  EXPECT_TRUE(made.tracker.statistics.occlusion_test);
  EXPECT_FALSE(made.tracker.consistency_test);
}

TEST(SlamParameters, NoDeviationsTurnOutlierRemovalOff) {
  Options options;
  options.dense.outlier_deviations = 0;
  EXPECT_EQ(parameters_of(options).dense.outliers.neighbors, 0);
}

TEST(SlamParameters, OfOptionsOutOfRangeAreAnError) {
  Options options;
  options.features.keypoints = 5;
  EXPECT_THROW(parameters_of(options), Error);
}

}  // namespace
}  // namespace stillmap
