// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

namespace stillmap {

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

}  // namespace stillmap
