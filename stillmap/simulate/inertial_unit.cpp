// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/inertial_unit.hpp"

#include "stillmap/simulate/random.hpp"

#include <cmath>

namespace stillmap {
namespace {

constexpr double kRate = 200;  // Hz
/// Step of the differences from which velocities are taken [s]: the samples are means over it, so
/// that a corner of the path gives a finite acceleration with the right change of velocity.
constexpr double kStep = 1 / kRate;
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

std::vector<OdometrySample> simulated_odometry(const std::function<Pose(double)>& T_world_camera,
                                               double begin, double end, const Wheels& wheels,
                                               int seed, bool noise) {
  constexpr std::uint64_t kStream = 0x3ee1;  // of random numbers
  constexpr double kWheelRate = 50, kStepError = 0.01, kHalf = 0.5;
  simulate::Random random(static_cast<std::uint64_t>(seed), kStream);
  const double error = noise ? kHalf : 0, step_error = noise ? kStepError : 0;
  const double length_scale = 1 + error * wheels.length_error * random.normal(),
               angle_scale = 1 + error * wheels.angle_error * random.normal();
  const Eigen::Vector3d turn = error * wheels.angle_per_length * normal_vector(random);
  const auto T_world_base = [&](double time) {
    return T_world_camera(time) * wheels.T_camera_base;
  };
  std::vector<OdometrySample> samples{{begin, Pose()}};
  for (int i = 1; begin + i / kWheelRate <= end; ++i) {
    const double before = samples.back().timestamp, now = begin + i / kWheelRate;
    const Pose step = T_world_base(before).inverse() * T_world_base(now);
    const Eigen::Vector3d &t = step.translation(), w = so3_log(step.quaternion());
    const Pose measured(
        so3_exp(angle_scale * w + t.norm() * turn + step_error * w.norm() * normal_vector(random)),
        length_scale * t + step_error * t.norm() * normal_vector(random));
    samples.push_back({now, samples.back().T_odom_base * measured});
  }
  return samples;
}

}  // namespace stillmap
