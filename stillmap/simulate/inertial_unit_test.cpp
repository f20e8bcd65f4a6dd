// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/inertial_unit.hpp"

#include "stillmap/inertial/preintegration.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(InertialUnit, ExactSamplesGiveTheMotionOfTheCamera) {
  const SimulatedSequence sequence(
      {.people = 0, .camera = "halfsphere", .frames = 40, .width = 64, .height = 48});
  Imu imu = find_imu("d435i");
  imu.T_camera_imu = Pose(so3_exp({0.3, -0.2, 1.2}), {0.05, -0.02, 0.03});
  const auto samples = simulated_imu([&](double t) { return sequence.motion(t); }, -0.1, 1.5, imu,
                                     1, /*noise=*/false);
  const double begin = 0.2, end = 1.1;
  const auto motion = preintegrate(samples, begin, end, imu, {});
  ASSERT_TRUE(motion);
  const Pose T_i = sequence.motion(begin) * imu.T_camera_imu,
             T_j = sequence.motion(end) * imu.T_camera_imu;
  const Eigen::Quaterniond turned = T_i.quaternion().conjugate() * T_j.quaternion();
  EXPECT_LT(so3_log(turned.conjugate() * motion->rotation({})).norm(), 2e-4);
  constexpr double kStep = 1e-4;
  const Eigen::Vector3d v = ((sequence.motion(begin + kStep) * imu.T_camera_imu).translation() -
                             (sequence.motion(begin - kStep) * imu.T_camera_imu).translation()) /
                            (2 * kStep);
  const Eigen::Vector3d gravity(0, 0, -9.81);
  const double t = end - begin;
  const Eigen::Vector3d p =
      T_i.translation() + v * t + 0.5 * t * t * gravity + T_i.quaternion() * motion->position({});
  EXPECT_LT((p - T_j.translation()).norm(), 5e-3);
}

TEST(InertialUnit, ErrorsAreThoseOfTheUnit) {
  const auto rest = [](double) { return Pose(); };
  const Imu imu = find_imu("d435i");
  const auto samples = simulated_imu(rest, 0, 20, imu, 3);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = mean;
  for (const ImuSample& sample : samples) mean += sample.angular_velocity;
  mean /= static_cast<double>(samples.size());
  for (const ImuSample& sample : samples)
    square += (sample.angular_velocity - mean).cwiseAbs2() / static_cast<double>(samples.size());
  EXPECT_GT(mean.norm(), 0.002);
  EXPECT_LT(mean.norm(), 4 * imu.gyro_bias);
  EXPECT_NEAR(std::sqrt(square.mean()), imu.gyro_noise * std::sqrt(200), 2e-4);
}

}  // namespace
}  // namespace stillmap
