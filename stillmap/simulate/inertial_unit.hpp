// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/imu.hpp"

#include <functional>
#include <vector>

namespace stillmap {

/// Errors of a simulated IMU besides those that Imu describes.
struct InertialErrors {
  bool noise = true;          ///< Whether there are noise, biases and their random walks.
  double gyro_scale = 1;      ///< Factor on the angular velocities.
  double largest_rate = 1e9;  ///< Largest angular velocity that is measured [rad/s].
};

/// Returns the samples of an IMU between two times at 200 Hz, from the exact motion of the camera.
/// Equal arguments give equal samples.
/// @param T_world_camera  pose by time; the world has its z axis up
/// @param imu             mounting, noise and time offset; biases are drawn from its deviations
std::vector<ImuSample> simulated_imu(const std::function<Pose(double)>& T_world_camera,
                                     double begin, double end, const Imu& imu, int seed,
                                     const InertialErrors& errors = {});

}  // namespace stillmap
