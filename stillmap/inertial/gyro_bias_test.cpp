// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/gyro_bias.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;

TEST(GyroBias, IsThatBetweenMeasuredAndSeenRotations) {
  const Vector3d bias(0.012, -0.02, 0.007), rate(0.3, -0.2, 0.5);
  const Eigen::Matrix3d noise = 1e-8 * Eigen::Matrix3d::Identity();
  GyroBias filter(Imu{});
  const double before = filter.covariance().trace();
  for (int i = 0; i < 60; ++i) {
    Preintegration measured(Imu{}, {.gyro = filter.mean()});
    for (int k = 0; k < 10; ++k) measured.integrate(rate + bias, Vector3d::Zero(), 1.0 / 300);
    const Eigen::Quaterniond seen = so3_exp(rate / 30);
    const Eigen::Quaterniond own = measured.rotation({.gyro = filter.mean()});
    filter.add(measured, so3_log(own.conjugate() * seen), noise);
  }
  EXPECT_NEAR((filter.mean() - bias).norm(), 0, 1e-5);
  EXPECT_LT(filter.covariance().trace(), 1e-2 * before);
}

TEST(GyroBias, AnUncertainRotationTellsLittle) {
  GyroBias filter(Imu{});
  Preintegration measured(Imu{}, {});
  measured.integrate(Vector3d::Zero(), Vector3d::Zero(), 1.0 / 30);
  filter.add(measured, {0.05, 0, 0}, Eigen::Matrix3d::Identity());
  EXPECT_LT(filter.mean().norm(), 1e-5);
}

}  // namespace
}  // namespace stillmap
