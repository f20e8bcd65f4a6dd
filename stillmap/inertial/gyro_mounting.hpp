// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <deque>
#include <optional>

#include <Eigen/Geometry>

namespace stillmap {

/// Estimates how a gyroscope is mounted on a camera: the rotation that turns its measurements into
/// the rotations that the images show, by least squares (Arun, Huang and Blostein, PAMI 1987). A
/// constant bias has no influence.
class GyroMounting {
 public:
  /// Adds the rotation vectors of one motion [rad].
  /// @param measured  by the gyroscope, in its frame
  /// @param seen      by the images, in the frame of the camera
  void add(const Eigen::Vector3d& measured, const Eigen::Vector3d& seen);
  void clear() { pairs_.clear(); }

  /// Returns the orientation of the gyroscope in the camera, from the newest motions; none unless
  /// it is certain to half a degree, and agrees much better with them than another one.
  /// @param R_camera_imu  the other one
  std::optional<Eigen::Quaterniond> instead_of(const Eigen::Quaterniond& R_camera_imu) const;

 private:
  struct Pair {
    Eigen::Vector3d measured, seen;
  };
  std::deque<Pair> pairs_;  // the newest last
};

}  // namespace stillmap
