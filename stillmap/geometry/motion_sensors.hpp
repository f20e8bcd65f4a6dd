// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// One measurement of an inertial measurement unit, in its own frame.
struct ImuSample {
  double timestamp = 0;  ///< [s], by the clock of the images: see Imu::time_offset.
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  /// Specific force [m/s^2]: 9.81 upward at rest.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();

  /// Returns whether the measurement of another sample is the same. Noise makes every one another,
  /// so that equal samples are one that the sensor or its driver repeats.
  bool repeats(const ImuSample& other) const {
    return angular_velocity == other.angular_velocity && acceleration == other.acceleration;
  }
};

/// Noise and mounting of an inertial measurement unit. The default noise is that of a consumer
/// sensor whose data sheet is not known.
struct Imu {
  std::string name = "other";
  /// Pose of the IMU in the frame of the rectified camera.
  Pose T_camera_imu;
  /// Noise densities of the gyroscope [rad/s/sqrt(Hz)] and of the accelerometer [m/s^2/sqrt(Hz)].
  double gyro_noise = 5e-4, accel_noise = 5e-3;
  /// Random walks of the biases [rad/s^2/sqrt(Hz)] and [m/s^3/sqrt(Hz)].
  double gyro_walk = 2e-5, accel_walk = 5e-4;
  /// Standard deviations of the biases when the unit is switched on [rad/s] and [m/s^2].
  double gyro_bias = 0.02, accel_bias = 0.3;
  /// Time stamp of a sample minus the time of an image taken at the same moment [s].
  double time_offset = 0;
};

/// Pose of a robot by its wheels: T_odom_base of nav_msgs/Odometry. Only motions between samples
/// are used, so that the odometry's frame may be any.
struct OdometrySample {
  double timestamp = 0;  ///< [s], by the clock of the images.
  Pose T_odom_base;
};

/// The wheels of the robot that carries the camera.
struct Wheels {
  Pose T_camera_base;  ///< Pose of the robot's base in the frame of the rectified camera.
  /// Standard deviations of a motion by the wheels: of its length and of its angle, relative to
  /// them, and of the angle per length [rad/m].
  double length_error = 0.03, angle_error = 0.03, angle_per_length = 0.02;
};

/// Returns the unit built into a camera, with the noise of its data sheet and axes along the
/// optical ones: docs/cameras.md. Throws Error with the known names.
Imu find_imu(std::string_view name);
/// Returns the names that find_imu() knows.
const std::vector<std::string>& imu_names();

}  // namespace stillmap
