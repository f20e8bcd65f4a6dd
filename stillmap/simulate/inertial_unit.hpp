// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"

#include <functional>
#include <vector>

namespace stillmap {

/// Returns the samples of an IMU between two times at 200 Hz, from the exact motion of the camera.
/// Equal arguments give equal samples.
/// @param T_world_camera  pose by time; the world has its z axis up
/// @param imu             mounting, noise and time offset; biases are drawn from its deviations
/// @param noise           whether there are noise, biases and their random walks
std::vector<ImuSample> simulated_imu(const std::function<Pose(double)>& T_world_camera,
                                     double begin, double end, const Imu& imu, int seed,
                                     bool noise = true);

/// Returns the odometry of wheels between two times at 50 Hz, as if the base moved with the camera
/// in all directions. Errors: the scales of lengths and angles, a turn per length, drawn from half
/// the deviations of `wheels`, and 1 % of each step at random.
std::vector<OdometrySample> simulated_odometry(const std::function<Pose(double)>& T_world_camera,
                                               double begin, double end, const Wheels& wheels,
                                               int seed, bool noise = true);

}  // namespace stillmap
