// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/world_alignment.hpp"

#include "stillmap/base/test_error.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr int kFrames = 100;
const Pose kTruthEstimate(so3_exp({0.1, 0.7, -0.3}), {4, 5, 6});

struct Worlds {
  Trajectory truth, estimate;
};

/// Returns a camera that moves along x [m per frame] and y (an arc). The estimate is in another
/// world frame and has errors of 5 mm and 0.2 degrees (standard deviations).
Worlds camera_path(double step, double arc) {
  std::mt19937 random(1);
  std::normal_distribution<double> position(0, 0.005), angle(0, 0.0035);
  Worlds worlds;
  for (int i = 0; i < kFrames; ++i) {
    const Pose T(so3_exp({0, 0.3, 0}), {step * i, arc * std::sin(0.05 * i), 1});
    const Pose error = Pose::exp({position(random), position(random), position(random),
                                  angle(random), angle(random), angle(random)});
    worlds.truth.push_back({i / 30.0, T});
    worlds.estimate.push_back({i / 30.0, kTruthEstimate.inverse() * T * error});
  }
  return worlds;
}

WorldAlignment align(const Worlds& worlds) {
  return align_worlds(worlds.truth, worlds.estimate,
                      absolute_trajectory_error(worlds.truth, worlds.estimate));
}

/// Returns the position error of a map point 5 m in front of the first camera [m].
double map_error(const Worlds& worlds, const Pose& T_truth_estimate) {
  const Eigen::Vector3d p_truth = worlds.truth.front().T_world_camera * Eigen::Vector3d(0, 0, 5);
  return (T_truth_estimate * (kTruthEstimate.inverse() * p_truth) - p_truth).norm();
}

/// Without rotations, the angle of the map about a straight path is arbitrary, so points are off by
/// meters. The mean of 100 rotation errors of 0.2 degrees displaces the point by 5 m * 0.2 deg / 10
/// = 2 mm, and by no more than 1 cm.
TEST(WorldAlignment, AStraightPathIsAlignedByWholePoses) {
  const Worlds worlds = camera_path(0.05, 0);
  const WorldAlignment alignment = align(worlds);
  EXPECT_EQ(alignment.by, WorldAlignment::By::kPoses);
  EXPECT_LT(map_error(worlds, require_alignment(alignment)), 0.01);
  const auto ate = absolute_trajectory_error(worlds.truth, worlds.estimate);
  EXPECT_GT(map_error(worlds, ate.T_truth_estimate), 0.1) << "positions alone do not determine it";
  // Errors along three axes: sqrt(3) times 5 mm and 0.2 degrees, of 100 poses.
  EXPECT_NEAR(alignment.position_rmse, 0.0087, 0.001);
  EXPECT_NEAR(alignment.angle_rmse, 0.0061, 0.001);
  EXPECT_NE(alignment_text(alignment).find("aligned by whole poses"), std::string::npos);
}

TEST(WorldAlignment, ARestingCameraIsAlignedByWholePoses) {
  const Worlds worlds = camera_path(0, 0);
  const WorldAlignment alignment = align(worlds);
  EXPECT_EQ(alignment.by, WorldAlignment::By::kPoses);
  EXPECT_LT(map_error(worlds, require_alignment(alignment)), 0.01);
}

TEST(WorldAlignment, ACameraWithoutAnyErrorIsAlignedByWholePosesIfAtRest) {
  Worlds worlds = camera_path(0, 0);
  worlds.estimate = worlds.truth;
  for (StampedPose& pose : worlds.estimate)
    pose.T_world_camera = kTruthEstimate.inverse() * pose.T_world_camera;
  EXPECT_LT(map_error(worlds, require_alignment(align(worlds))), 1e-9);
}

/// The positions of a wide arc determine the rotation to 9 mm / 0.7 m, the rotations to 0.35
/// degrees.
TEST(WorldAlignment, AWideArcIsAlignedByWholePoses) {
  const Worlds worlds = camera_path(0.02, 1);
  const WorldAlignment alignment = align(worlds);
  EXPECT_EQ(alignment.by, WorldAlignment::By::kPoses);
  const auto ate = absolute_trajectory_error(worlds.truth, worlds.estimate);
  EXPECT_LT(map_error(worlds, require_alignment(alignment)),
            map_error(worlds, ate.T_truth_estimate));
}

/// The truth has the rotations of a body that is turned by 10 degrees against the camera.
TEST(WorldAlignment, ATruthOfAnotherBodyIsAlignedByPositions) {
  Worlds worlds = camera_path(0.02, 1);
  const Trajectory camera = worlds.truth;
  for (StampedPose& pose : worlds.truth)
    pose.T_world_camera = pose.T_world_camera * Pose(so3_exp({0, 0, 0.17}), {0, 0, 0});
  const WorldAlignment alignment = align(worlds);
  EXPECT_EQ(alignment.by, WorldAlignment::By::kPositions);
  worlds.truth = camera;
  EXPECT_LT(map_error(worlds, require_alignment(alignment)), 0.03);
  EXPECT_EQ(alignment_text(alignment), "");
}

TEST(WorldAlignment, ATruthWithoutRotationsDoesNotAlignAStraightPath) {
  Worlds worlds = camera_path(0.05, 0);
  for (int i = 0; i < kFrames; ++i) {
    StampedPose &truth = worlds.truth[i], &estimate = worlds.estimate[i];
    truth.T_world_camera = Pose(Eigen::Matrix3d::Identity(), truth.T_world_camera.translation());
    estimate.T_world_camera = estimate.T_world_camera * Pose(so3_exp({0, 0.01 * i, 0}), {0, 0, 0});
  }
  const std::string error = test::error_of([&] { require_alignment(align(worlds)); });
  EXPECT_NE(error.find("do not determine the rotation of the map"), std::string::npos) << error;
}

TEST(AlignPoses, PosesOfAnotherRecordingHaveNoStampInCommon) {
  Worlds worlds = camera_path(0.02, 1);
  EXPECT_LT(map_error(worlds, align_poses(worlds.truth, worlds.estimate)), 0.01);
  for (StampedPose& pose : worlds.estimate) pose.timestamp += 1000;
  const std::string error = test::error_of([&] { align_poses(worlds.truth, worlds.estimate); });
  EXPECT_NE(error.find("no stamp in common"), std::string::npos) << error;
}

}  // namespace
}  // namespace stillmap
