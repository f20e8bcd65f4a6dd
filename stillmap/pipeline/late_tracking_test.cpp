// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/recording_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using recorded::Recording, recorded::recording, recorded::small_options, recorded::black;

/// Number of frames at the start without depth, from which no map can be started.
constexpr std::size_t kWithoutDepth = 8;
constexpr std::size_t kFrames = 40;

enum class Start { kNoDepth, kDark };

/// Returns the result for a recording whose first frames are incomplete.
SlamResult result_of(Start start, bool final_adjustment) {
  const Recording& rec = recording(0, "xyz");
  SlamParameters options = small_options("static");
  options.final_adjustment = final_adjustment;
  SlamSystem slam(rec.sequence->camera(), options);
  for (std::size_t i = 0; i < kFrames; ++i) {
    auto frame = std::make_shared<RgbdFrame>(*rec.frames[i]);
    if (i < kWithoutDepth) frame->depth = black(frame->depth);
    if (i < kWithoutDepth && start == Start::kDark) {
      frame->gray = black(frame->gray);
      frame->color = black(frame->color);
    }
    EXPECT_EQ(slam.push(frame).has_value(), i >= kWithoutDepth) << i;
  }
  return slam.finish();
}

TEST(LateTracking, FramesBeforeTheMapAreTrackedInItAtTheEnd) {
  const SlamResult result = result_of(Start::kNoDepth, true);
  ASSERT_EQ(result.trajectory.size(), kFrames);
  const SimulatedSequence& sequence = *recording(0, "xyz").sequence;
  for (std::size_t i = 0; i < kWithoutDepth; ++i) {
    EXPECT_TRUE(result.frames[i].tracked_late) << i;
    const Pose truth = sequence.T_world_camera(kFrames - 1).inverse() * sequence.T_world_camera(i);
    const Pose estimate =
        result.trajectory.back().T_world_camera.inverse() * result.trajectory[i].T_world_camera;
    EXPECT_LT((truth.inverse() * estimate).translation().norm(), 0.02) << i;
    EXPECT_LT((truth.inverse() * estimate).angle(), 0.005) << i;
    EXPECT_GT(result.poses[i].covariance.trace(), 0) << i;
  }
  EXPECT_FALSE(result.frames[kWithoutDepth].tracked_late);
}

TEST(LateTracking, FramesWithoutKeypointsStayWithoutAPose) {
  const SlamResult result = result_of(Start::kDark, true);
  EXPECT_EQ(result.trajectory.size(), kFrames - kWithoutDepth);
}

/// Root mean square error of all poses [m].
double error_with(std::uint64_t memory, bool final_adjustment) {
  const Recording& rec = recording(0, "xyz");
  SlamParameters options = small_options("static");
  options.keyframe_memory = memory;
  options.final_adjustment = final_adjustment;
  options.dense_cloud = false;
  SlamSystem slam(rec.sequence->camera(), options);
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  return absolute_trajectory_error(rec.sequence->trajectory(), slam.finish().trajectory)
      .translation.rmse;
}

TEST(LateTracking, MakesAllPosesBetter) {
  const double before = error_with(30000000, false);
  EXPECT_LT(error_with(30000000, true), 0.9 * before) << before;
}

TEST(LateTracking, GivesTheSamePosesFromTheFile) {
  EXPECT_EQ(error_with(0, true), error_with(30000000, true));
}

TEST(LateTracking, NothingIsTrackedAgainWithoutTheFinalAdjustment) {
  const SlamResult result = result_of(Start::kNoDepth, false);
  EXPECT_EQ(result.trajectory.size(), kFrames - kWithoutDepth);
}

/// The poses by a gyroscope have errors in common, which smoothing would not reduce.
TEST(LateTracking, PosesWithAnImuAreNotWorseThanThoseWithout) {
  const SimulatedSequence sequence({.people = 1,
                                    .camera = "halfsphere",
                                    .frames = 90,
                                    .width = 320,
                                    .height = 240,
                                    .seed = 11,
                                    .imu = "d435i"});
  const auto error = [&](bool imu) {
    Camera camera = sequence.camera();
    if (!imu) camera.imu.reset();
    SlamSystem slam(camera, small_options("fused"));
    for (std::size_t i = 0; i < sequence.frames(); ++i) slam.push(sequence.frame(i));
    return absolute_trajectory_error(sequence.trajectory(), slam.finish().trajectory)
        .translation.rmse;
  };
  EXPECT_LT(error(true), 1.1 * error(false));
}

}  // namespace
}  // namespace stillmap
