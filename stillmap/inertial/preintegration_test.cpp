// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/preintegration.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;

constexpr double kStep = 0.001;  // s

Vector3d rate(int i) { return {0.4 * std::sin(0.01 * i), 0.3, -0.2 + 0.0004 * i}; }
Vector3d force(int i) { return {0.5, -9.6 + 0.002 * i, 0.8 * std::cos(0.006 * i)}; }

Preintegration integrated(const Imu& imu, const ImuBias& bias, int steps = 500) {
  Preintegration result(imu, bias);
  for (int i = 0; i < steps; ++i) result.integrate(rate(i), force(i), kStep);
  return result;
}

TEST(Preintegration, ConstantRotationAndAccelerationAreExact) {
  Preintegration result(Imu{}, {});
  for (int i = 0; i < 1000; ++i) result.integrate({0, 0, 0.5}, Vector3d::Zero(), kStep);
  EXPECT_NEAR(result.seconds(), 1, 1e-12);
  EXPECT_NEAR((so3_log(result.rotation({})) - Vector3d(0, 0, 0.5)).norm(), 0, 1e-12);
  Preintegration straight(Imu{}, {});
  for (int i = 0; i < 1000; ++i) straight.integrate(Vector3d::Zero(), {2, 0, 0}, kStep);
  EXPECT_NEAR((straight.velocity({}) - Vector3d(2, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((straight.position({}) - Vector3d(1, 0, 0)).norm(), 0, 1e-12);
}

TEST(Preintegration, AnotherBiasAgreesWithIntegratingAgain) {
  const ImuBias bias{{0.01, -0.02, 0.015}, {0.1, 0.05, -0.2}};
  const ImuBias other{bias.gyro + Vector3d(1e-3, -2e-3, 1.5e-3),
                      bias.accel + Vector3d(0.02, -0.01, 0.03)};
  const Preintegration first = integrated(Imu{}, bias), again = integrated(Imu{}, other);
  EXPECT_NEAR(so3_log(first.rotation(other).conjugate() * again.rotation(other)).norm(), 0, 2e-6);
  EXPECT_NEAR((first.velocity(other) - again.velocity(other)).norm(), 0, 2e-5);
  EXPECT_NEAR((first.position(other) - again.position(other)).norm(), 0, 5e-6);
  EXPECT_GT(so3_log(first.rotation(bias).conjugate() * again.rotation(other)).norm(), 1e-3);
}

void expect_near(const Vector3d& found, const Vector3d& expected, double error) {
  EXPECT_NEAR((found - expected).norm(), 0, error) << found.transpose();
}

/// Values of GTSAM 4.3.0 (PreintegratedImuMeasurements, without integration covariance), which
/// integrates in the tangent space: with longer steps it differs in the second order.
TEST(Preintegration, AgreesWithGtsam) {
  Imu imu;
  imu.gyro_noise = 1e-3;
  imu.accel_noise = 1e-2;
  const ImuBias bias{{0.01, -0.02, 0.015}, {0.1, 0.05, -0.2}};
  const Preintegration result = integrated(imu, bias);
  constexpr double kError = 1e-6;
  expect_near(so3_log(result.rotation(bias)), {0.025262927756, 0.161310055502, -0.052245312983},
              kError);
  expect_near(result.velocity(bias), {0.022337903719, -4.573371711711, -0.093050066187}, kError);
  expect_near(result.position(bias), {0.018434164577, -1.165429506275, 0.026755147134}, kError);
  // GTSAM's covariance is that of rotation, position and velocity in the tangent space at time i.
  const auto variances = result.covariance().diagonal();
  expect_near(1e6 * variances.middleRows<3>(3), {53.388705238, 50.012871138, 53.376204233}, 1e-3);
  expect_near(1e6 * variances.bottomRows<3>(), {4.298641456, 4.166811258, 4.298519425}, 1e-3);

  const ImuBias other{{0.011, -0.022, 0.0165}, {0.12, 0.04, -0.17}};
  expect_near(so3_log(result.rotation(other)), {0.024772513183, 0.162338458884, -0.052961406285},
              kError);
  expect_near(result.velocity(other), {0.009711491824, -4.567400158943, -0.105787489839}, kError);
  expect_near(result.position(other), {0.015502511841, -1.163984541019, 0.023385626755}, kError);
}

TEST(Preintegration, SamplesAreInterpolatedBetweenTwoTimes) {
  std::vector<ImuSample> samples;
  for (int i = 0; i < 20; ++i) samples.push_back({0.01 * i, {0.1 * i, 0, 0}, {0, 0, 0}});
  // The angular velocity is 10 t: from 0.033 to 0.061 s it turns by 5 (t_2^2 - t_1^2).
  const auto result = preintegrate(samples, 0.033, 0.061, Imu{}, {});
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->seconds(), 0.028, 1e-12);
  EXPECT_NEAR(so3_log(result->rotation({})).x(), 5 * (0.061 * 0.061 - 0.033 * 0.033), 1e-9);
}

TEST(Preintegration, TimesWithoutSamplesGiveNone) {
  std::vector<ImuSample> samples;
  for (int i = 0; i < 20; ++i)
    samples.push_back({.timestamp = 0.01 * i, .angular_velocity = {0.001 * i, 0, 0}});
  EXPECT_TRUE(preintegrate(samples, 0.0, 0.19, Imu{}, {}));
  EXPECT_FALSE(preintegrate(samples, -0.01, 0.1, Imu{}, {}));
  EXPECT_FALSE(preintegrate(samples, 0.1, 0.2, Imu{}, {}));
  EXPECT_FALSE(preintegrate(samples, 0.1, 0.1, Imu{}, {}));
  EXPECT_FALSE(preintegrate({}, 0, 0.1, Imu{}, {}));
  samples.erase(samples.begin() + 5, samples.begin() + 12);
  EXPECT_FALSE(preintegrate(samples, 0.03, 0.15, Imu{}, {}));
  EXPECT_TRUE(preintegrate(samples, 0.12, 0.15, Imu{}, {}));
}

TEST(Preintegration, ASampleThatIsRepeatedIsNone) {
  std::vector<ImuSample> samples;
  for (int i = 0; i < 20; ++i)
    samples.push_back({.timestamp = 0.01 * i, .angular_velocity = {0.001 * std::min(i, 8), 0, 0}});
  EXPECT_TRUE(preintegrate(samples, 0.02, 0.13, Imu{}, {})) << "as in a gap of 50 ms";
  EXPECT_FALSE(preintegrate(samples, 0.02, 0.15, Imu{}, {}));
}

}  // namespace
}  // namespace stillmap
