// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/trajectory_smoother.hpp"

#include <cmath>
#include <cstdint>

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

/// Adds independent errors to every pose.
Trajectory measured(Trajectory path, double sigma, double sigma_rotation, std::uint64_t seed = 3) {
  cv::RNG random(seed);
  const auto error = [&random](double s) {
    return Eigen::Vector3d(random.gaussian(s), random.gaussian(s), random.gaussian(s));
  };
  for (StampedPose& pose : path) {
    const Pose& T = pose.T_world_camera;
    pose.T_world_camera =
        Pose(T.quaternion() * so3_exp(error(sigma_rotation)), T.translation() + error(sigma));
  }
  return path;
}

struct Rms {
  double position = 0, rotation = 0;
};
Rms rms_error(const Trajectory& a, const Trajectory& truth) {
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
  const Trajectory truth = hand_held(), noisy = measured(truth, 0.005, 0.003);
  const Rms before = rms_error(noisy, truth), after = rms_error(smooth_trajectory(noisy), truth);
  EXPECT_LT(after.position, 0.6 * before.position);
  EXPECT_LT(after.rotation, 0.6 * before.rotation);
}

TEST(TrajectorySmoother, AveragesTheErrorsOfACameraAtRest) {
  const Trajectory truth = hand_held(0), noisy = measured(truth, 0.005, 0.003);
  const Rms before = rms_error(noisy, truth), after = rms_error(smooth_trajectory(noisy), truth);
  EXPECT_LT(after.position, 0.3 * before.position);
  EXPECT_LT(after.rotation, 0.3 * before.rotation);
}

TEST(TrajectorySmoother, LeavesAPathWithoutErrorsAsItIs) {
  const Trajectory truth = hand_held();
  const Rms after = rms_error(smooth_trajectory(truth), truth);
  EXPECT_LT(after.position, 1e-4);
  EXPECT_LT(after.rotation, 1e-4);
}

TEST(TrajectorySmoother, ASingleWrongPoseHasLittleInfluence) {
  const Trajectory truth = hand_held();
  Trajectory noisy = measured(truth, 0.003, 0.002);
  Pose& wrong = noisy[120].T_world_camera;
  wrong = Pose(wrong.quaternion() * so3_exp({0, 0.1, 0}),
               wrong.translation() + Eigen::Vector3d(0.2, 0, 0));
  const Trajectory smooth = smooth_trajectory(noisy);
  for (std::size_t i = 110; i < 130; ++i) {
    const Pose E = truth[i].T_world_camera.inverse() * smooth[i].T_world_camera;
    EXPECT_LT(E.translation().norm(), 0.015) << i;
    EXPECT_LT(E.angle(), 0.01) << i;
  }
}

TEST(TrajectorySmoother, BridgesMissingFrames) {
  const Trajectory truth = hand_held();
  Trajectory expected = truth, noisy = measured(truth, 0.005, 0.003);
  expected.erase(expected.begin() + 100, expected.begin() + 110);
  noisy.erase(noisy.begin() + 100, noisy.begin() + 110);
  EXPECT_LT(rms_error(smooth_trajectory(noisy), expected).position, 0.006);
}

TEST(TrajectorySmoother, KeepsTimestampsAndShortPaths) {
  const Trajectory few = measured(hand_held(1, 9), 0.01, 0.01), same = smooth_trajectory(few);
  ASSERT_EQ(same.size(), few.size());
  for (std::size_t i = 0; i < few.size(); ++i)
    EXPECT_EQ(same[i].T_world_camera.translation(), few[i].T_world_camera.translation());
  const Trajectory path = hand_held(), smooth = smooth_trajectory(path);
  ASSERT_EQ(smooth.size(), path.size());
  for (std::size_t i = 0; i < path.size(); ++i) EXPECT_EQ(smooth[i].timestamp, path[i].timestamp);
  EXPECT_TRUE(smooth_trajectory({}).empty());
}

}  // namespace
}  // namespace stillmap
