// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/inertial/contradictions.hpp"
#include "stillmap/inertial/preintegration.hpp"

#include <optional>
#include <span>

namespace stillmap {

/// Position, velocity and orientation of a camera by its IMU, corrected by the poses that its
/// images give: an error-state Kalman filter (Sola, Quaternion kinematics for the error-state
/// Kalman filter, 2017) that is propagated with Preintegration from frame to frame. Gravity has the
/// length 9.80665 m/s^2; its direction in the world is part of the state, since the world of a map
/// is the camera of its first frame.
class InertialNavigation {
 public:
  explicit InertialNavigation(const Imu& imu);

  /// Propagates the state to the time of a frame. Without samples for that time, without plausible
  /// accelerations in them, and before the first pose, there is no state afterwards.
  /// @param samples  by increasing time
  void propagate(std::span<const ImuSample> samples, double timestamp);

  /// Corrects the state by the pose of the frame, or begins with it.
  void correct(const UncertainPose& pose);

  /// Corrects the velocity, and with it the position and the biases, by the images of an unknown
  /// place, which show the velocity alone.
  /// @param error  velocity by the images minus that of the state, in the world [m/s]
  void correct_velocity(const Eigen::Vector3d& error);

  /// Moves the state along with a correction of the map.
  void move(const Pose& T_corrected_world);

  /// Takes a pose of the frame in another world: the motion and gravity relative to the camera stay
  /// as they are.
  void enter(const UncertainPose& pose);

  /// Returns the pose of the camera at the time of the state, with its covariance; none without a
  /// state.
  std::optional<UncertainPose> pose() const;

  /// Returns whether the state was corrected for two seconds, so that it can be used.
  bool is_settled() const;

  /// Returns whether the newest corrections contradict the state, or the accelerations are not
  /// those of a camera near the earth's surface in m/s^2.
  bool contradicted() const;

  /// Returns the covariance of a pose by images with the errors of the map.
  static Eigen::Matrix<double, 6, 6> with_map_error(const Eigen::Matrix<double, 6, 6>& of_images);

  const ImuBias& bias() const { return bias_; }
  /// Returns the acceleration of gravity in the world [m/s^2].
  const Eigen::Vector3d& gravity() const { return gravity_; }
  /// Returns the upward direction in the frame of the camera; none without a state that
  /// is_settled(), and where its standard deviation is above half a degree.
  std::optional<Eigen::Vector3d> up_in_camera() const;
  /// Returns the standard deviation of the velocity, in the direction in which it is largest of the
  /// axes [m/s].
  double velocity_sigma() const;

 private:
  static constexpr int kStates = 18;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  void begin(const UncertainPose& pose);
  bool is_plausible() const;
  template <int Rows>
  double update(const Eigen::Matrix<double, Rows, kStates>& H,
                const Eigen::Matrix<double, Rows, 1>& innovation,
                const Eigen::Matrix<double, Rows, Rows>& noise);
  Pose T_world_imu() const { return Pose(rotation_, position_); }
  void drift(double meters);
  UncertainPose of_imu(const UncertainPose& camera) const;

  Imu imu_;
  bool begun_ = false;    // whether there is a state
  double since_ = 0;      // time of the first correction [s]
  double timestamp_ = 0;  // of the state [s]
  Eigen::Vector3d mean_acceleration_ =
      Eigen::Vector3d::Zero();  // around the newest frame, in the IMU
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero(), velocity_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  ImuBias bias_;
  Eigen::Vector3d gravity_ = Eigen::Vector3d::Zero();
  // Of the errors of position, velocity, rotation (in the IMU), biases of gyroscope and
  // accelerometer, and direction of gravity (in the world).
  Covariance P_ = Covariance::Zero();
  Contradictions contradictions_{60, 4};  // of the corrections
};

}  // namespace stillmap
