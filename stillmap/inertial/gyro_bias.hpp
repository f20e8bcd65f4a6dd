// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/inertial/preintegration.hpp"

namespace stillmap {

/// The bias of a gyroscope, estimated from the rotations of the camera that its images show: a
/// Kalman filter with a random walk.
class GyroBias {
 public:
  explicit GyroBias(const Imu& imu);

  const Eigen::Vector3d& mean() const { return mean_; }  ///< [rad/s]
  const Eigen::Matrix3d& covariance() const { return covariance_; }

  /// Adds a rotation that was measured by both.
  /// @param measured    by the gyroscope
  /// @param difference  rotation vector from the rotation of the gyroscope, with mean() as bias, to
  ///                    that of the images, in the frame of the IMU at its end [rad]
  /// @param covariance  of the difference, without that of the bias
  void add(const Preintegration& measured, const Eigen::Vector3d& difference,
           const Eigen::Matrix3d& covariance);

 private:
  double walk_variance_;  // [rad^2/s^3]
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_;
};

}  // namespace stillmap
