// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/trajectory_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace stillmap {
namespace {

/// A hand-held camera: sinusoids of 0.3 to 2 Hz, and turns of 20 degrees per second.
Trajectory hand_held(double amplitude = 1, int count = 300) {
  Trajectory path;
  for (int i = 0; i < count; ++i) {
    const double t = i / 30.0, a = amplitude;
    path.push_back({t, Pose(so3_exp(a * Eigen::Vector3d(0.2 * std::sin(2 * t), 0.35 * t,
                                                        0.05 * std::sin(9 * t))),
                            a * Eigen::Vector3d(0.3 * std::sin(2 * t), 0.2 * std::cos(1.3 * t),
                                                0.003 * std::sin(12 * t)))});
  }
  return path;
}

/// Adds independent errors of standard deviations `sigma` [m] and `sigma_rotation` [rad] to every
/// pose.
/// @param told factor of the covariances that the poses are given
std::vector<UncertainPose> measured(const Trajectory& path, double sigma, double sigma_rotation,
                                    double told = 1) {
  cv::RNG random(3);
  const auto error = [&random](double s) {
    return Eigen::Vector3d(random.gaussian(s), random.gaussian(s), random.gaussian(s));
  };
  std::vector<UncertainPose> poses;
  for (const auto& [timestamp, T] : path) {
    UncertainPose pose{timestamp, Pose(T.quaternion() * so3_exp(error(sigma_rotation)),
                                       T.translation() + error(sigma))};
    pose.covariance.diagonal().head<3>().setConstant(told * sigma * sigma);
    pose.covariance.diagonal().tail<3>().setConstant(told * sigma_rotation * sigma_rotation);
    poses.push_back(pose);
  }
  return poses;
}

struct Rms {
  double position = 0, rotation = 0;
};
Rms rms_error(const std::vector<UncertainPose>& a, const Trajectory& truth) {
  Rms sum;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Pose E = truth[i].T_world_camera.inverse() * a[i].T_world_camera;
    sum.position += E.translation().squaredNorm();
    sum.rotation += E.angle() * E.angle();
  }
  const auto n = static_cast<double>(a.size());
  return {std::sqrt(sum.position / n), std::sqrt(sum.rotation / n)};
}

TEST(TrajectorySmoother, HalvesIndependentErrors) {
  const Trajectory truth = hand_held();
  const auto noisy = measured(truth, 0.005, 0.003);
  const Rms before = rms_error(noisy, truth), after = rms_error(smooth_trajectory(noisy), truth);
  EXPECT_LT(after.position, 0.6 * before.position);
  EXPECT_LT(after.rotation, 0.6 * before.rotation);
}

TEST(TrajectorySmoother, AveragesTheErrorsOfACameraAtRest) {
  const Trajectory truth = hand_held(0);
  const auto noisy = measured(truth, 0.005, 0.003);
  const Rms before = rms_error(noisy, truth), after = rms_error(smooth_trajectory(noisy), truth);
  EXPECT_LT(after.position, 0.3 * before.position);
  EXPECT_LT(after.rotation, 0.3 * before.rotation);
}

TEST(TrajectorySmoother, LeavesAPathWithoutErrorsAsItIs) {
  const Trajectory truth = hand_held();
  const Rms after = rms_error(smooth_trajectory(measured(truth, 1e-6, 1e-6)), truth);
  EXPECT_LT(after.position, 1e-4);
  EXPECT_LT(after.rotation, 1e-4);
}

TEST(TrajectorySmoother, ASingleWrongPoseHasLittleInfluence) {
  const Trajectory truth = hand_held();
  auto noisy = measured(truth, 0.003, 0.002);
  Pose& wrong = noisy[120].T_world_camera;
  wrong = Pose(wrong.quaternion() * so3_exp({0, 0.1, 0}),
               wrong.translation() + Eigen::Vector3d(0.2, 0, 0));
  const auto smooth = smooth_trajectory(noisy);
  for (std::size_t i = 110; i < 130; ++i) {
    const Pose E = truth[i].T_world_camera.inverse() * smooth[i].T_world_camera;
    EXPECT_LT(E.translation().norm(), 0.015) << i;
    EXPECT_LT(E.angle(), 0.01) << i;
  }
}

/// A hand that turns back and forth at 40 degrees per second, measured to 0.05 degrees.
TEST(TrajectorySmoother, JerksAreNotTakenForWrongPoses) {
  Trajectory truth;
  for (int i = 0; i < 300; ++i) {
    const int phase = i % 24;
    truth.push_back({i / 30.0, Pose(so3_exp({0, 0.0233 * std::min(phase, 24 - phase), 0}),
                                    Eigen::Vector3d::Zero())});
  }
  const auto noisy = measured(truth, 0.001, 0.0009);
  const Rms before = rms_error(noisy, truth), after = rms_error(smooth_trajectory(noisy), truth);
  EXPECT_LT(after.rotation, before.rotation);
}

/// A shaken camera that hardly turns: an error of the position that comes with one of the rotation
/// is recognized by the rotation.
TEST(TrajectorySmoother, CorrelatedErrorsAreRemovedTogether) {
  Trajectory truth;
  for (int i = 0; i < 300; ++i) {
    const double t = i / 30.0;
    truth.push_back({t, Pose(so3_exp({0, 0.1 * t, 0}), {0.05 * std::sin(20 * t), 0, 0})});
  }
  cv::RNG random(5);
  std::vector<UncertainPose> correlated = measured(truth, 0.001, 0.0001), independent;
  for (UncertainPose& pose : correlated) {
    const double e = random.gaussian(0.006);
    pose.T_world_camera = pose.T_world_camera * Pose(so3_exp({0, 0.5 * e, 0}), {e, 0, 0});
    pose.covariance(0, 0) += 0.006 * 0.006;
    pose.covariance(4, 4) += 0.003 * 0.003;
    independent.push_back(pose);
    pose.covariance(0, 4) = pose.covariance(4, 0) = 0.006 * 0.003;
  }
  EXPECT_LT(rms_error(smooth_trajectory(correlated), truth).position,
            0.6 * rms_error(smooth_trajectory(independent), truth).position);
}

/// Returns the mean of the squared errors over the covariances; 6 is expected.
double normalized_error(const std::vector<UncertainPose>& poses, const Trajectory& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose E = poses[i].T_world_camera.inverse() * truth[i].T_world_camera;
    Eigen::Matrix<double, 6, 1> e;
    e << E.translation(), so3_log(E.quaternion());
    sum += e.dot(poses[i].covariance.ldlt().solve(e));
  }
  return sum / static_cast<double>(poses.size());
}

TEST(TrajectorySmoother, ErrorsFollowTheCovariances) {
  const Trajectory truth = hand_held(1, 900);
  for (const double told : {1.0, 0.25}) {  // errors as large as given, and twice as large
    const auto smooth = smooth_trajectory(measured(truth, 0.005, 0.003, told));
    EXPECT_GT(normalized_error(smooth, truth), 2) << told;
    EXPECT_LT(normalized_error(smooth, truth), 9) << told;
  }
}

TEST(TrajectorySmoother, SmoothingDoesNotReduceTheErrorOfTheMap) {
  // The poses vary by half of their given standard deviation: the rest is common to them.
  const auto noisy = measured(hand_held(), 0.005, 0.003, 4);
  for (const UncertainPose& pose : smooth_trajectory(noisy)) {
    EXPECT_GT(pose.covariance(0, 0), 0.6 * noisy.front().covariance(0, 0));
    EXPECT_LT(pose.covariance(0, 0), 1.1 * noisy.front().covariance(0, 0));
  }
}

TEST(TrajectorySmoother, BridgesMissingFrames) {
  const Trajectory truth = hand_held();
  Trajectory expected = truth;
  auto noisy = measured(truth, 0.005, 0.003);
  expected.erase(expected.begin() + 100, expected.begin() + 110);
  noisy.erase(noisy.begin() + 100, noisy.begin() + 110);
  EXPECT_LT(rms_error(smooth_trajectory(noisy), expected).position, 0.006);
}

TEST(TrajectorySmoother, KeepsTimestampsAndShortPaths) {
  const auto few = measured(hand_held(1, 9), 0.01, 0.01), same = smooth_trajectory(few);
  ASSERT_EQ(same.size(), few.size());
  for (std::size_t i = 0; i < few.size(); ++i)
    EXPECT_EQ(same[i].T_world_camera.translation(), few[i].T_world_camera.translation());
  const auto path = measured(hand_held(), 0.01, 0.01), smooth = smooth_trajectory(path);
  ASSERT_EQ(smooth.size(), path.size());
  for (std::size_t i = 0; i < path.size(); ++i) EXPECT_EQ(smooth[i].timestamp, path[i].timestamp);
  EXPECT_TRUE(smooth_trajectory({}).empty());
}

}  // namespace
}  // namespace stillmap
