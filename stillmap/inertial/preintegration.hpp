// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"

#include <optional>
#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stillmap {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// Biases of an IMU, which are added to its measurements.
struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// The measurements of an IMU between two times i and j as one relative motion, which does not
/// depend on the state at time i (Forster, Carlone, Dellaert, Scaramuzza, On-manifold
/// preintegration for real-time visual-inertial odometry, TRO 2017; equations in brackets). With
/// the gravity g [m/s^2] in the world, the velocity v, and t = seconds():
///
///     R_j = R_i rotation(b),  v_j = v_i + g t + R_i velocity(b),
///     p_j = p_i + v_i t + g t^2 / 2 + R_i position(b).
class Preintegration {
 public:
  /// @param bias  for which the measurements are integrated
  Preintegration(const Imu& imu, const ImuBias& bias);

  /// Adds a measurement that is constant for a time (eq. 35; covariance eq. 63, Jacobians of the
  /// appendix).
  /// @param angular_velocity [rad/s]  @param acceleration specific force [m/s^2]  @param dt [s]
  void integrate(const Eigen::Vector3d& angular_velocity, const Eigen::Vector3d& acceleration,
                 double dt);

  double seconds() const { return seconds_; }
  const ImuBias& bias() const { return bias_; }

  /// Relative motion with another bias, to first order (eq. 44). Rotation, velocity [m/s] and
  /// position [m] in the frame at time i.
  Eigen::Quaterniond rotation(const ImuBias& bias) const;
  Eigen::Vector3d velocity(const ImuBias& bias) const;
  Eigen::Vector3d position(const ImuBias& bias) const;

  /// Derivative of the rotation vector, in the frame at time j, by the bias of the gyroscope.
  const Eigen::Matrix3d& rotation_by_gyro() const { return rotation_by_gyro_; }
  /// Derivatives of (rotation vector in the frame at time j, velocity, position) by the biases of
  /// gyroscope and accelerometer.
  Eigen::Matrix<double, 9, 6> by_bias() const;

  /// Covariance of (rotation vector in the frame at time j, velocity, position) due to the noise of
  /// the measurements, without that of the biases.
  const Matrix9d& covariance() const { return covariance_; }

 private:
  double gyro_variance_, accel_variance_;  // of the noise densities
  ImuBias bias_;
  double seconds_ = 0;
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero(), position_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation_by_gyro_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d velocity_by_gyro_ = Eigen::Matrix3d::Zero(),
                  velocity_by_accel_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_gyro_ = Eigen::Matrix3d::Zero(),
                  position_by_accel_ = Eigen::Matrix3d::Zero();
  Matrix9d covariance_ = Matrix9d::Zero();
};

/// Returns the motion between two times, with measurements that change linearly from sample to
/// sample. None if the samples do not cover the time, or leave a gap of more than 50 ms,
/// in which there is none or the same one is repeated.
/// @param samples  by increasing time
std::optional<Preintegration> preintegrate(std::span<const ImuSample> samples, double begin,
                                           double end, const Imu& imu, const ImuBias& bias);

/// Returns the right Jacobian of SO(3) (eq. 8): exp(w + d) = exp(w) exp(J d) to first order.
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w);

}  // namespace stillmap
