// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/motion_consistency.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace stillmap {
namespace {

constexpr double kSigma = 0.002, kSigmaRotation = 0.001;

/// A hand-held camera at 30 Hz, measured with noise.
std::vector<UncertainPose> hand_held(int count) {
  cv::RNG random(7);
  const auto error = [&random](double s) {
    return Eigen::Vector3d(random.gaussian(s), random.gaussian(s), random.gaussian(s));
  };
  std::vector<UncertainPose> poses;
  for (int i = 0; i < count; ++i) {
    const double t = i / 30.0;
    UncertainPose pose;
    pose.timestamp = t;
    pose.T_world_camera =
        Pose(so3_exp(Eigen::Vector3d(0.2 * std::sin(2 * t), 0.35 * t, 0.05 * std::sin(9 * t)) +
                     error(kSigmaRotation)),
             Eigen::Vector3d(0.3 * std::sin(2 * t), 0.2 * std::cos(1.3 * t), 0) + error(kSigma));
    pose.covariance.diagonal().head<3>().setConstant(kSigma * kSigma);
    pose.covariance.diagonal().tail<3>().setConstant(kSigmaRotation * kSigmaRotation);
    poses.push_back(pose);
  }
  return poses;
}

void displace(UncertainPose& pose, double x) {
  pose.T_world_camera = Pose(pose.T_world_camera.quaternion(),
                             pose.T_world_camera.translation() + Eigen::Vector3d(x, 0, 0));
}

/// Returns the indices of the poses that contradict the motion.
std::vector<std::size_t> contradictions(const std::vector<UncertainPose>& poses) {
  MotionConsistency consistency;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (consistency.contradiction(poses[i])) found.push_back(i);
  return found;
}

TEST(MotionConsistency, AHandHeldCameraIsConsistent) {
  EXPECT_TRUE(contradictions(hand_held(300)).empty());
}

TEST(MotionConsistency, OnlyTheWrongPoseContradicts) {
  auto poses = hand_held(200);
  displace(poses[120], 0.1);
  EXPECT_EQ(contradictions(poses), std::vector<std::size_t>{120});
}

TEST(MotionConsistency, TheCovarianceCoversTheError) {
  auto poses = hand_held(121);
  displace(poses[120], 0.1);
  MotionConsistency consistency;
  for (std::size_t i = 0; i < 120; ++i) consistency.contradiction(poses[i]);
  const auto covariance = consistency.contradiction(poses[120]);
  ASSERT_TRUE(covariance);
  EXPECT_GT(std::sqrt((*covariance)(0, 0)), 0.01);
}

TEST(MotionConsistency, AStepThatLastsIsAccepted) {
  auto poses = hand_held(200);
  for (std::size_t i = 120; i < poses.size(); ++i) displace(poses[i], 0.1);
  EXPECT_EQ(contradictions(poses), (std::vector<std::size_t>{120, 121, 122}));
}

TEST(MotionConsistency, NothingIsComparedAcrossAReset) {
  auto poses = hand_held(200);
  for (std::size_t i = 120; i < poses.size(); ++i) displace(poses[i], 1);
  MotionConsistency consistency;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i == 120) consistency.reset();
    EXPECT_FALSE(consistency.contradiction(poses[i])) << i;
  }
}

TEST(MotionConsistency, ACorrectionOfTheMapIsNoMotion) {
  auto poses = hand_held(200);
  const Pose correction(so3_exp({0.1, 0, 0.2}), {0.5, 0, 0});
  MotionConsistency consistency;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i >= 120) poses[i].T_world_camera = correction * poses[i].T_world_camera;
    if (i == 120) consistency.move(correction);
    EXPECT_FALSE(consistency.contradiction(poses[i])) << i;
  }
}

}  // namespace
}  // namespace stillmap
