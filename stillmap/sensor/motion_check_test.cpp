// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/motion_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Returns ten seconds of an IMU at 200 Hz and of wheels at 20 Hz, of a camera that is carried.
MotionSamples right_samples() {
  MotionSamples samples;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.005 * i;
    samples.imu.push_back(
        {t, {0.5, 0.2, -0.3 + 1e-4 * t}, {0.4, -9.7, 0.6 + (i % 7 == 0 ? 2.0 : 0.0)}});
  }
  for (int i = 0; i < 200; ++i) samples.odometry.push_back({0.05 * i, Pose()});
  return samples;
}

std::vector<std::string> messages(const MotionSamples& samples) {
  std::vector<std::string> texts;
  for (const Finding& finding : motion_findings(samples)) {
    EXPECT_EQ(finding.code, "motion-samples");
    texts.push_back(finding.message);
  }
  return texts;
}

TEST(MotionCheck, FindsNothingInRightSamples) {
  EXPECT_THAT(messages(right_samples()), IsEmpty());
  EXPECT_THAT(messages({}), IsEmpty());
}

TEST(MotionCheck, AcceptsAGyroscopeAlone) {
  MotionSamples samples = right_samples();
  for (ImuSample& sample : samples.imu) sample.acceleration.setZero();
  EXPECT_THAT(messages(samples), IsEmpty());
}

TEST(MotionCheck, TellsAccelerationsInG) {
  MotionSamples samples = right_samples();
  for (ImuSample& sample : samples.imu) sample.acceleration /= 9.80665;
  EXPECT_THAT(messages(samples), ElementsAre(HasSubstr("as in g")));
}

TEST(MotionCheck, TellsAccelerationsWithoutGravity) {
  MotionSamples samples = right_samples();
  for (ImuSample& sample : samples.imu) sample.acceleration.y() += 9.7;
  EXPECT_THAT(messages(samples), ElementsAre(HasSubstr("gravity has 9.81 m/s^2")));
}

TEST(MotionCheck, TellsDegrees) {
  MotionSamples samples = right_samples();
  samples.imu[0].angular_velocity.x() = 1e4;  // one wrong sample says nothing
  EXPECT_THAT(messages(samples), IsEmpty());
  for (std::size_t i = 0; i < 200; ++i) samples.imu[10 * i].angular_velocity.x() = 90;
  EXPECT_THAT(messages(samples), ElementsAre(HasSubstr("as in degrees/s")));
}

TEST(MotionCheck, TellsASampleThatIsRepeatedAsAGap) {
  MotionSamples samples = right_samples();
  for (std::size_t i = 401; i < 404; ++i) {
    samples.imu[i].angular_velocity = samples.imu[400].angular_velocity;
    samples.imu[i].acceleration = samples.imu[400].acceleration;
  }
  EXPECT_THAT(messages(samples), IsEmpty()) << "15 ms";
  for (std::size_t i = 401; i < 600; ++i) {
    samples.imu[i].angular_velocity = samples.imu[400].angular_velocity;
    samples.imu[i].acceleration = samples.imu[400].acceleration;
  }
  EXPECT_THAT(messages(samples),
              ElementsAre(HasSubstr("of the IMU: 1, the longest 1.00 s after 2.000")));
}

TEST(MotionCheck, TellsGaps) {
  MotionSamples samples = right_samples();
  samples.imu.erase(samples.imu.begin() + 400, samples.imu.begin() + 600);
  samples.odometry.erase(samples.odometry.begin() + 50, samples.odometry.begin() + 60);
  EXPECT_THAT(messages(samples),
              ElementsAre(HasSubstr("of the IMU: 1, the longest 1.00 s after 1.995"),
                          HasSubstr("of the wheels: 1, the longest 0.55 s after 2.45")));
}

}  // namespace
}  // namespace stillmap
