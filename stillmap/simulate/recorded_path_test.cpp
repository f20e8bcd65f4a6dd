// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/recorded_path.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap::simulate {
namespace {

constexpr double kStart = 1341845688.7;  // s

/// Returns a swing of 0.2 m and 0.3 rad in two seconds, at 100 Hz, from a pose that is not the
/// identity.
Pose swing(double seconds) {
  const double angle = std::sin(std::numbers::pi * seconds);
  return Pose(so3_exp({0.1, 0.3 * angle, 0}), {1 + 0.2 * angle, -2, 1.5});
}

Trajectory recording(double seconds, double interval) {
  Trajectory trajectory;
  for (double t = 0; t <= seconds; t += interval) trajectory.push_back({kStart + t, swing(t)});
  return trajectory;
}

TEST(RecordedPath, FollowsTheRecording) {
  const RecordedPath path(recording(4, 0.01));
  EXPECT_NEAR(path.duration(), 4, 0.011);
  for (double t = 0.2; t < 3.8; t += 0.037) {
    const Pose error = (swing(0).inverse() * swing(t)).inverse() * path.at(t);
    EXPECT_LT(error.translation().norm(), 0.002) << t;
    EXPECT_LT(so3_log(error.quaternion()).norm(), 0.003) << t;
  }
}

TEST(RecordedPath, AccelerationIsContinuous) {
  const RecordedPath path(recording(4, 0.01));
  constexpr double kStep = 1e-3;
  const auto acceleration = [&](double t) {
    const auto p = [&](double time) { return Eigen::Vector3d(path.at(time).translation()); };
    return Eigen::Vector3d((p(t + kStep) - 2 * p(t) + p(t - kStep)) / (kStep * kStep));
  };
  // By the swing at most 0.2 pi^2 = 1.97 m/s^2, which changes by at most 6.2 m/s^3.
  for (double t = 1; t < 3; t += 0.01) {
    EXPECT_LT(acceleration(t).norm(), 2.2) << t;
    EXPECT_LT((acceleration(t + 0.01) - acceleration(t)).norm(), 0.1) << t;
  }
}

TEST(RecordedPath, BridgesGapsAndRestsAtItsEnds) {
  Trajectory trajectory = recording(4, 0.01);
  std::erase_if(trajectory, [](const StampedPose& pose) {
    return pose.timestamp > kStart + 1.4 && pose.timestamp < kStart + 1.6;
  });
  const RecordedPath path(trajectory);
  const Pose error = (swing(0).inverse() * swing(1.5)).inverse() * path.at(1.5);
  EXPECT_LT(error.translation().norm(), 0.02);
  EXPECT_EQ(path.at(-1).translation(), path.at(0).translation());
  EXPECT_EQ(path.at(9).translation(), path.at(path.duration()).translation());
}

TEST(RecordedPath, IsAMotionOfTheSimulatedCamera) {
  const auto file = test::own_path("recorded_path.txt");
  write_trajectory(file, recording(2, 0.01));
  SimulationOptions options;
  options.people = 0;
  options.camera = file.string();
  options.frames = 50;
  options.width = 64;
  options.height = 48;
  const SimulatedSequence sequence(options);
  const Pose moved = sequence.T_world_camera(12).inverse() * sequence.T_world_camera(45);
  const Pose difference = (swing(12 / 30.0).inverse() * swing(1.5)).inverse() * moved;
  EXPECT_LT(difference.translation().norm(), 0.003);

  options.frames = 90;
  const auto error = [&] { return test::error_of([&] { SimulatedSequence other(options); }); };
  EXPECT_THAT(error(), testing::HasSubstr("take at most 60 frames"));
  options.camera = "circle";
  EXPECT_THAT(error(), testing::HasSubstr("'circle' is neither known nor a file"));
}

}  // namespace
}  // namespace stillmap::simulate
