// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/inertial_navigation.hpp"

#include "stillmap/inertial/inertial_prediction.hpp"

#include <cmath>
#include <functional>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;

constexpr double kFrame = 1.0 / 30, kSample = 1.0 / 200;
constexpr double kDriftMeters = 0.01, kDriftRadians = 0.005;  // per square root of a meter
constexpr double kMeters = 2e-3, kRadians = 1e-3;             // noise of the poses

/// A path through a room whose vertical is oblique in the world of the map.
Pose path(double t) {
  const Pose T_map_room(so3_exp({-1.2, 0.4, 0.1}), {0.3, 0.2, 0.1});
  const Pose T_room_camera(
      so3_exp({0.2 * std::sin(0.9 * t), 0.4 * t, 0.15 * std::cos(1.1 * t)}),
      {1.5 * std::sin(0.5 * t), 1.2 * std::cos(0.4 * t), 0.1 * std::sin(1.3 * t)});
  return T_map_room * T_room_camera;
}

const Vector3d kGravity = so3_exp({-1.2, 0.4, 0.1}) * Vector3d(0, 0, -9.80665);

/// A run along the path, in the world of a map that drifts while it shows the pose.
class Journey {
 public:
  explicit Journey(const Imu& imu, unsigned seed = 1) : imu_(imu), random_(seed), filter_(imu) {
    for (double t = -kFrame; t < 30; t += kSample) samples_.push_back(sample(t));
  }

  /// Moves on to a frame.
  void go(bool with_pose) {
    time_ += kFrame;
    filter_.propagate(samples_, time_);
    prediction_.propagate(samples_, time_);
    if (!with_pose) return;
    drift((path(time_).translation() - path(time_ - kFrame).translation()).norm());
    UncertainPose pose{time_, truth()};
    pose.covariance.diagonal() << Vector3d::Constant(kMeters * kMeters),
        Vector3d::Constant(kRadians * kRadians);
    Eigen::Matrix<double, 6, 1> error;
    error << kMeters * normal(), kRadians * normal();
    pose.T_world_camera = pose.T_world_camera * Pose::exp(error);
    take(pose);
  }
  /// Moves on to a frame whose pose is that of the frame before.
  void follow(UncertainPose pose) {
    time_ += kFrame;
    filter_.propagate(samples_, time_);
    prediction_.propagate(samples_, time_);
    pose.timestamp = time_;
    take(pose);
  }
  void go_for(double seconds, bool with_pose) {
    for (double t = 0; t < seconds; t += kFrame) go(with_pose);
  }

  Eigen::Matrix<double, 6, 1> error() const {
    return (filter_.pose()->T_world_camera.inverse() * truth()).log();
  }
  double squared_error() const {
    return error().dot(filter_.pose()->covariance.llt().solve(error()));
  }

  InertialNavigation& filter() { return filter_; }
  InertialPrediction& prediction() { return prediction_; }
  Pose truth() const { return T_map_room_ * path(time_); }
  Pose truth_in_room() const { return path(time_); }
  std::vector<ImuSample>& samples() { return samples_; }

  void stop_drift() { drift_ = 0; }

 private:
  void take(const UncertainPose& pose) {
    filter_.correct(pose);
    prediction_.compare(pose, filter_);
  }
  /// Turns the world about the camera, and moves it.
  void drift(double meters) {
    const Vector3d at = path(time_).translation();
    const double sigma = drift_ * std::sqrt(meters);
    const Eigen::Quaterniond turn = so3_exp(kDriftRadians * sigma * normal());
    T_map_room_ = T_map_room_ * Pose(turn, at - turn * at + kDriftMeters * sigma * normal());
  }
  Vector3d normal() { return {one_(random_), one_(random_), one_(random_)}; }
  ImuSample sample(double t) {
    constexpr double kStep = 1e-4;
    const auto T = [&](double at) { return path(at) * imu_.T_camera_imu; };
    const Pose a = T(t - kStep), b = T(t), c = T(t + kStep);
    const Vector3d acceleration =
        (a.translation() - 2 * b.translation() + c.translation()) / (kStep * kStep);
    const double white = 1 / std::sqrt(kSample);
    return {t,
            so3_log(a.quaternion().conjugate() * c.quaternion()) / (2 * kStep) +
                Vector3d(0.01, -0.02, 0.005) + white * imu_.gyro_noise * normal(),
            b.quaternion().conjugate() * (acceleration - kGravity) + Vector3d(0.1, 0.2, -0.15) +
                white * imu_.accel_noise * normal()};
  }

  Imu imu_;
  std::mt19937 random_;
  std::normal_distribution<double> one_{0, 1};
  std::vector<ImuSample> samples_;
  InertialNavigation filter_;
  InertialPrediction prediction_;
  double time_ = 0;
  double drift_ = 1;  // as a factor on that which is expected
  Pose T_map_room_;
};

Imu mounted() {
  Imu imu = find_imu("d435i");
  imu.T_camera_imu = Pose(so3_exp({0.1, 1.5, -0.2}), {0.03, -0.01, 0.02});
  return imu;
}

TEST(InertialNavigation, GravityAndBiasesAreEstimatedFromThePoses) {
  Journey journey(mounted());
  journey.stop_drift();
  journey.go_for(15, true);
  const double tilt = std::acos(journey.filter().gravity().normalized().dot(kGravity.normalized()));
  EXPECT_LT(tilt, 0.5 * M_PI / 180);
  EXPECT_LT((journey.filter().bias().gyro - Vector3d(0.01, -0.02, 0.005)).norm(), 1e-3);
  EXPECT_LT((journey.filter().bias().accel - Vector3d(0.1, 0.2, -0.15)).norm(), 0.05);
}

TEST(InertialNavigation, TheUpwardDirectionIsKnownInTheCamera) {
  for (unsigned run = 1; run <= 20; ++run) {
    Journey journey(mounted(), run);
    journey.go_for(1, true);
    EXPECT_FALSE(journey.filter().up_in_camera());
    journey.go_for(14, true);
    const auto up = journey.filter().up_in_camera();
    ASSERT_TRUE(up);
    const Vector3d truth = -(journey.truth_in_room().quaternion().conjugate() * kGravity);
    EXPECT_LT(std::acos(std::min(1.0, up->dot(truth.normalized()))), 0.5 * M_PI / 180) << run;
  }
}

TEST(InertialNavigation, SecondsWithoutPosesAreBridgedAsUncertainAsItSays) {
  constexpr int kRuns = 20;
  double largest = 0, squared = 0;
  for (unsigned run = 1; run <= kRuns; ++run) {
    Journey journey(mounted(), run);
    journey.go_for(8, true);
    journey.go_for(3, false);
    ASSERT_TRUE(journey.filter().pose());
    largest = std::max(largest, journey.error().head<3>().norm());
    squared += journey.squared_error() / kRuns;
  }
  EXPECT_LT(largest, 0.5);  // three standard deviations
  EXPECT_GT(squared, 1);    // 6 is expected; the covariance of poses is enlarged for those of maps
  EXPECT_LT(squared, 9);
}

TEST(InertialNavigation, CorrectionsOfTheMapMoveTheState) {
  Journey journey(mounted());
  journey.go_for(8, true);
  const Pose before = journey.filter().pose()->T_world_camera;
  const Pose T(so3_exp({0.3, -0.1, 0.2}), {1, 2, 3});
  const Vector3d gravity = journey.filter().gravity();
  journey.filter().move(T);
  EXPECT_TRUE(
      ((T * before).inverse() * journey.filter().pose()->T_world_camera).log().isZero(1e-9));
  EXPECT_TRUE(journey.filter().gravity().isApprox(T.rotation() * gravity, 1e-9));
}

TEST(InertialNavigation, AccelerationsInMultiplesOfGravityAreNotUsed) {
  Journey journey(mounted());
  for (ImuSample& sample : journey.samples()) sample.acceleration /= 9.80665;
  journey.go_for(3, true);
  EXPECT_FALSE(journey.filter().pose());
  EXPECT_TRUE(journey.filter().contradicted());
}

TEST(InertialNavigation, WithoutAccelerationsThereIsNoPose) {
  Journey journey(mounted());
  for (ImuSample& sample : journey.samples()) sample.acceleration.setZero();
  journey.go_for(4, true);
  EXPECT_FALSE(journey.filter().pose());
}

TEST(InertialNavigation, AGapInTheSamplesEndsThePose) {
  Journey journey(mounted());
  journey.go_for(4, true);
  EXPECT_TRUE(journey.filter().pose());
  std::erase_if(journey.samples(),
                [](const ImuSample& s) { return s.timestamp > 4.05 && s.timestamp < 4.3; });
  journey.go_for(0.5, false);
  EXPECT_FALSE(journey.filter().pose());
}

TEST(InertialPrediction, RightAccelerationsAreNotContradicted) {
  for (unsigned run = 1; run <= 20; ++run) {
    Journey journey(mounted(), run);
    for (int second = 0; second < 20; ++second) {
      journey.go_for(1, true);
      EXPECT_FALSE(journey.prediction().contradicted()) << run << ' ' << second;
    }
  }
}

TEST(InertialPrediction, AccelerationsThatThePosesContradictAreRecognized) {
  Journey journey(mounted());
  for (ImuSample& sample : journey.samples()) sample.acceleration *= -1;
  journey.go_for(10, true);
  EXPECT_TRUE(journey.prediction().contradicted());
}

TEST(InertialPrediction, TellsTheMotionOfTheCameraFromThatOfSomebodyWhoIsFollowed) {
  Journey journey(mounted());
  journey.go_for(8, true);
  UncertainPose followed{0, journey.truth()};
  followed.covariance = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
  for (int i = 0; i < 7; ++i) journey.follow(followed);
  const auto pose = journey.prediction().pose();
  ASSERT_TRUE(pose);
  const auto distance = [&](const Pose& other) {
    const Eigen::Matrix<double, 6, 1> d = (pose->T_world_camera.inverse() * other).log();
    return d.dot(pose->covariance.llt().solve(d));
  };
  EXPECT_LT(distance(journey.truth()), 22.5);
  EXPECT_GT(distance(followed.T_world_camera), 100);
}

}  // namespace
}  // namespace stillmap
