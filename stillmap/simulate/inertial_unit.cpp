// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/inertial_unit.hpp"

#include "stillmap/simulate/random.hpp"

#include <cmath>

namespace stillmap {
namespace {

constexpr double kRate = 200;   // Hz
constexpr double kStep = 1e-4;  // of the differences from which velocities are taken [s]
const Eigen::Vector3d kGravity(0, 0, -9.81);

Eigen::Vector3d normal_vector(simulate::Random& random) {
  return {random.normal(), random.normal(), random.normal()};
}

/// Returns angular velocity and specific force of a body, without errors.
ImuSample exact_sample(const std::function<Pose(double)>& T_world_imu, double time) {
  const Pose before = T_world_imu(time - kStep), now = T_world_imu(time),
             after = T_world_imu(time + kStep);
  const Eigen::Vector3d acceleration =
      (after.translation() - 2 * now.translation() + before.translation()) / (kStep * kStep);
  return {time, so3_log(before.quaternion().conjugate() * after.quaternion()) / (2 * kStep),
          now.quaternion().conjugate() * (acceleration - kGravity)};
}

}  // namespace

std::vector<ImuSample> simulated_imu(const std::function<Pose(double)>& T_world_camera,
                                     double begin, double end, const Imu& imu, int seed,
                                     bool noise) {
  constexpr std::uint64_t kStream = 0x1a0;  // of random numbers
  simulate::Random random(static_cast<std::uint64_t>(seed), kStream);
  const auto T_world_imu = [&](double time) { return T_world_camera(time) * imu.T_camera_imu; };
  Eigen::Vector3d gyro_bias = imu.gyro_bias * normal_vector(random),
                  accel_bias = imu.accel_bias * normal_vector(random);
  const double white = std::sqrt(kRate), walk = 1 / white;  // of densities, per sample
  std::vector<ImuSample> samples;
  for (int i = 0; begin + i / kRate <= end; ++i) {
    ImuSample sample = exact_sample(T_world_imu, begin + i / kRate);
    sample.timestamp += imu.time_offset;
    if (noise) {
      sample.angular_velocity += gyro_bias + white * imu.gyro_noise * normal_vector(random);
      sample.acceleration += accel_bias + white * imu.accel_noise * normal_vector(random);
      gyro_bias += walk * imu.gyro_walk * normal_vector(random);
      accel_bias += walk * imu.accel_walk * normal_vector(random);
    }
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace stillmap
