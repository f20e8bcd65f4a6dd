// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/wheel_navigation.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;

/// A robot that drives ahead at .5 m/s in a wide turn, with a camera on its mast.
class Drive : public ::testing::Test {
 protected:
  const Wheels wheels_{.T_camera_base = Pose(so3_exp({1.5, 0, 0}), {0, 1.2, -0.1})};
  WheelNavigation navigation_{wheels_};
  std::vector<OdometrySample> samples_;
  double time_ = 0;

  static Pose base(double t) { return Pose(so3_exp({0, 0, 0.3 * t}), {0.5 * t, 0.1 * t * t, 0}); }
  Pose camera(double t) const { return base(t) * wheels_.T_camera_base.inverse(); }
  void SetUp() override {
    const Pose T_odom_world(so3_exp({0, 0, 2}), {5, 6, 0});
    for (int i = -1; i < 500; ++i) samples_.push_back({0.02 * i, T_odom_world * base(0.02 * i)});
  }
  void drive(double seconds, bool with_pose, double slip = 0) {
    for (const double end = time_ + seconds; time_ < end;) {
      time_ += 1.0 / 30;
      navigation_.propagate(samples_, time_);
      UncertainPose pose{time_, camera(time_ * (1 - slip))};
      pose.covariance = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
      if (with_pose) navigation_.correct(pose, true);
    }
  }
};

TEST_F(Drive, MotionIsContinuedByTheWheels) {
  drive(3, true);
  drive(3, false);
  const auto pose = navigation_.pose();
  ASSERT_TRUE(pose);
  const auto error = (pose->T_world_camera.inverse() * camera(time_)).log();
  EXPECT_LT(error.head<3>().norm(), 1e-3);  // of interpolated samples
  EXPECT_LT(error.tail<3>().norm(), 1e-3);
  const double sigma = std::sqrt(pose->covariance.topLeftCorner<3, 3>().trace());
  EXPECT_GT(sigma, 0.05);  // after 2 m
  EXPECT_LT(sigma, 0.6);
}

TEST_F(Drive, TheMotionSinceEarlierTellsMovementsByTheImages) {
  drive(3, true);
  UncertainPose followed{time_, camera(time_)};
  for (int i = 0; i < 6; ++i) {  // the images show a camera at rest
    time_ += 1.0 / 30;
    navigation_.propagate(samples_, time_);
    followed.timestamp = time_;
    navigation_.correct(followed, true);
  }
  const auto pose = navigation_.pose_since_earlier();
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->T_world_camera.inverse() * camera(time_)).translation().norm(), 1e-3);
  const double sigma = std::sqrt(pose->covariance.topLeftCorner<3, 3>().trace());
  EXPECT_GT((pose->T_world_camera.inverse() * followed.T_world_camera).translation().norm(),
            3 * sigma);
}

TEST_F(Drive, WheelsThatSlipAreNotUsed) {
  drive(4, true, 0.5);
  EXPECT_FALSE(navigation_.pose());
  EXPECT_TRUE(navigation_.contradicted());
}

TEST_F(Drive, AnOdometryThatJumpsGivesNoPose) {
  drive(3, true);
  const Pose reset(so3_exp({0, 0, 1}), {5, 0, 0});
  for (OdometrySample& sample : samples_)
    if (sample.timestamp > 3.5) sample.T_odom_base = reset * sample.T_odom_base;
  drive(0.4, false);
  EXPECT_TRUE(navigation_.pose());
  drive(0.4, false);
  EXPECT_FALSE(navigation_.pose());
}

TEST_F(Drive, WithoutSamplesThereIsNoPose) {
  drive(1, true);
  samples_.resize(10);
  drive(0.2, false);
  EXPECT_FALSE(navigation_.pose());
}

}  // namespace
}  // namespace stillmap
