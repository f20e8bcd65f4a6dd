// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/gyro_clock.hpp"

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kFramePeriod = 1 / 30.0, kSamplePeriod = 1 / 200.0;

using AngularVelocity = std::function<Eigen::Vector3d(double)>;  // by time

Eigen::Vector3d swaying(double time) {
  return {std::sin(2.5 * time), 0.6 * std::sin(3.1 * time + 1), 0.2};
}

Eigen::Quaterniond rotation(const AngularVelocity& velocity, double from, double to) {
  constexpr int kSteps = 50;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  const double step = (to - from) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector3d turn = step * velocity(from + (i + 0.5) * step);
    q = q * Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  }
  return q;
}

/// Returns the offset after four seconds with a clock that is ahead of the images'.
/// @param noise  standard deviation of the images' rotations [rad]
std::optional<double> offset_of(const AngularVelocity& velocity, double ahead,
                                double noise = 0.001) {
  std::mt19937 random(7);
  std::normal_distribution<double> error(0, noise);
  GyroClock clock;
  std::vector<ImuSample> samples;
  double next = -1;
  for (int frame = 1; frame < 120; ++frame) {
    const double now = frame * kFramePeriod, before = now - kFramePeriod;
    for (; next <= now; next += kSamplePeriod)
      samples.push_back({.timestamp = next, .angular_velocity = velocity(next - ahead)});
    const Eigen::Vector3d wrong(error(random), error(random), error(random));
    const Eigen::Quaterniond seen =
        rotation(velocity, before, now) *
        Eigen::Quaterniond(Eigen::AngleAxisd(wrong.norm(), wrong.stableNormalized()));
    clock.add(samples, before, now, seen, {}, {});
  }
  return clock.offset();
}

TEST(GyroClock, ARightClockIsRight) {
  EXPECT_FALSE(offset_of(swaying, 0));
  EXPECT_FALSE(offset_of(swaying, 0.005)) << "less than a few frames of the sensor";
}

TEST(GyroClock, TellsHowFarAWrongOneIs) {
  for (const double ahead : {-0.1, -0.04, 0.06, 0.12}) {
    const auto offset = offset_of(swaying, ahead);
    ASSERT_TRUE(offset) << ahead;
    EXPECT_NEAR(*offset, ahead, 0.011);
  }
}

TEST(GyroClock, AConstantRotationTellsNothing) {
  EXPECT_FALSE(offset_of([](double) { return Eigen::Vector3d(0.3, 0.5, 0); }, 0.1));
}

TEST(GyroClock, WithoutMotionAndNoiseNothingIsTold) {
  EXPECT_FALSE(offset_of([](double) { return Eigen::Vector3d(Eigen::Vector3d::Zero()); }, 0.1, 0));
}

TEST(GyroClock, RotationsThatDoNotFitAtAllTellNothing) { EXPECT_FALSE(offset_of(swaying, 0, 0.1)); }

}  // namespace
}  // namespace stillmap
