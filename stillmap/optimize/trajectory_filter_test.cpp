// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/trajectory_filter.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace stillmap {
namespace {

constexpr double kInterval = 1.0 / 30;
constexpr double kSigma = 0.005;  // of the poses [m], and a quarter of it per radian

/// Returns the pose of a camera that swings by half a meter, four times a minute, and turns.
Pose true_pose(double t) {
  return Pose(so3_exp({0, 0.4 * std::sin(0.5 * t), 0}),
              {0.5 * std::sin(0.4 * t), 0.1 * std::cos(0.7 * t), 0.2 * t});
}

UncertainPose noisy_pose(double t, cv::RNG& random) {
  Eigen::Matrix<double, 6, 1> noise;
  for (int i = 0; i < 6; ++i) noise(i) = random.gaussian(i < 3 ? kSigma : kSigma / 4);
  UncertainPose pose{t, true_pose(t) * Pose::exp(noise)};
  pose.covariance.diagonal().head<3>().setConstant(kSigma * kSigma);
  pose.covariance.diagonal().tail<3>().setConstant(kSigma * kSigma / 16);
  return pose;
}

/// Root mean square errors [m] of the motion from pose to pose.
struct Jitter {
  double squares = 0;
  int count = 0;
  std::optional<Pose> error;

  void add(double t, const Pose& T_world_camera) {
    const Pose now = true_pose(t).inverse() * T_world_camera;
    if (error) squares += (now.translation() - error->translation()).squaredNorm(), ++count;
    error = now;
  }
  double rms() const { return std::sqrt(squares / count); }
};

TEST(TrajectoryFilter, ReducesTheJitterOfASmoothMotionToAThird) {
  cv::RNG random(1);
  TrajectoryFilter filter;
  Jitter before, after;
  for (int k = 0; k < 600; ++k) {
    const UncertainPose pose = noisy_pose(k * kInterval, random);
    const Pose filtered = filter.add(pose);
    if (k < 60) continue;
    before.add(pose.timestamp, pose.T_world_camera);
    after.add(pose.timestamp, filtered);
  }
  EXPECT_NEAR(before.rms(), std::sqrt(6.0) * kSigma, 0.1 * kSigma * std::sqrt(6.0));
  EXPECT_LT(after.rms(), before.rms() / 3);
}

TEST(TrajectoryFilter, IgnoresOneWrongPose) {
  cv::RNG random(2);
  TrajectoryFilter filter;
  for (int k = 0; k < 200; ++k) {
    UncertainPose pose = noisy_pose(k * kInterval, random);
    if (k == 150)
      pose.T_world_camera = pose.T_world_camera * Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0});
    const Pose filtered = filter.add(pose);
    const Pose error = true_pose(pose.timestamp).inverse() * filtered;
    EXPECT_LT(error.translation().norm(), (k < 60 ? 10 : 5) * kSigma) << k;
  }
}

TEST(TrajectoryFilter, FollowsASuddenStart) {
  cv::RNG random(3);
  TrajectoryFilter filter;
  for (int k = 0; k < 200; ++k) {
    const double t = k * kInterval;
    UncertainPose pose = noisy_pose(t, random);
    const double moved = std::max(0.0, t - 4) * 0.5;  // from rest to half a meter per second
    const Pose start(Eigen::Quaterniond::Identity(), {moved, 0, 0});
    const Pose T_true = start * true_pose(0);
    pose.T_world_camera = T_true * (true_pose(t).inverse() * pose.T_world_camera);
    const Pose filtered = filter.add(pose);
    const double error = (T_true.inverse() * filtered).translation().norm();
    EXPECT_LT(error, (k < 60 || (t > 4 && t < 4.3) ? 12 : 5) * kSigma) << k;
  }
}

TEST(TrajectoryFilter, MovesWithACorrectionOfTheMap) {
  const Pose T_corrected_world(so3_exp({0, 0, 0.3}), {1, 2, 3});
  cv::RNG random(4), same(4);
  TrajectoryFilter filter, moved;
  for (int k = 0; k < 100; ++k) {
    const Pose filtered = filter.add(noisy_pose(k * kInterval, random));
    UncertainPose pose = noisy_pose(k * kInterval, same);
    if (k == 80) moved.move(T_corrected_world);
    if (k >= 80) pose.T_world_camera = T_corrected_world * pose.T_world_camera;
    const Pose expected = k >= 80 ? T_corrected_world * filtered : filtered;
    EXPECT_LT((expected.inverse() * moved.add(pose)).log().norm(), 1e-6) << k;
  }
}

TEST(TrajectoryFilter, ReturnsThePosesAfterAResetAsTheyAre) {
  cv::RNG random(5);
  TrajectoryFilter filter;
  for (int k = 0; k < 100; ++k) filter.add(noisy_pose(k * kInterval, random));
  filter.reset();
  const UncertainPose pose = noisy_pose(100 * kInterval, random);
  EXPECT_EQ(filter.add(pose).translation(), pose.T_world_camera.translation());
}

TEST(TrajectoryFilter, ReturnsAPoseWithoutCovarianceAsItIs) {
  TrajectoryFilter filter;
  EXPECT_EQ(filter.add({0, true_pose(1)}).translation(), true_pose(1).translation());
}

}  // namespace
}  // namespace stillmap
