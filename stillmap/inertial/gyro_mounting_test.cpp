// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/gyro_mounting.hpp"

#include "stillmap/geometry/pose.hpp"

#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;

const Eigen::Quaterniond kMounted = so3_exp({0.4, -1.1, 0.7});

/// Motions of up to half a degree about all axes, or about one.
/// @param axes  applied to the measurements
GyroMounting motions(int count, double noise, const Vector3d& about = Vector3d::Ones(),
                     const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Vector3d(normal(rng), normal(rng), normal(rng)); };
  const Vector3d bias(5e-4, -3e-4, 6e-4);
  GyroMounting mounting;
  for (int i = 0; i < count; ++i) {
    const Vector3d seen = about.cwiseProduct(0.01 * draw());
    mounting.add(axes * (kMounted.conjugate() * seen) + bias, seen + noise * draw());
  }
  return mounting;
}

TEST(GyroMounting, FindsTheRotation) {
  const auto found = motions(150, 1e-3).instead_of(Eigen::Quaterniond::Identity());
  ASSERT_TRUE(found);
  EXPECT_LT(found->angularDistance(kMounted), 0.02);
  const auto exact = motions(60, 0).instead_of(Eigen::Quaterniond::Identity());
  ASSERT_TRUE(exact);
  EXPECT_LT(exact->angularDistance(kMounted), 1e-6);
}

TEST(GyroMounting, IsCertainOrNone) {
  EXPECT_FALSE(motions(59, 0).instead_of(Eigen::Quaterniond::Identity())) << "too few";
  EXPECT_FALSE(motions(150, 0.02).instead_of(Eigen::Quaterniond::Identity())) << "too much noise";
  EXPECT_FALSE(motions(150, 1e-3, {0, 1, 0}).instead_of(Eigen::Quaterniond::Identity()))
      << "about one axis";
  EXPECT_FALSE(motions(150, 1e-3).instead_of(kMounted)) << "it is mounted like that";
  const Eigen::Matrix3d mirrored = Vector3d(1, 1, -1).asDiagonal();
  EXPECT_FALSE(
      motions(150, 1e-3, Vector3d::Ones(), mirrored).instead_of(Eigen::Quaterniond::Identity()));
  EXPECT_FALSE(motions(150, 1e-3, Vector3d::Ones(), 57.3 * Eigen::Matrix3d::Identity())
                   .instead_of(Eigen::Quaterniond::Identity()))
      << "degrees";
}

}  // namespace
}  // namespace stillmap
