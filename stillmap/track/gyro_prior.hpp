// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/inertial/contradictions.hpp"
#include "stillmap/inertial/gyro_bias.hpp"
#include "stillmap/inertial/gyro_clock.hpp"
#include "stillmap/inertial/gyro_mounting.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"
#include "stillmap/track/tracked_frame.hpp"
#include "stillmap/track/tracker_state.hpp"

#include <optional>

#include <Eigen/Geometry>

namespace stillmap {

/// The rotation of the camera by its gyroscope, whose bias is estimated from the rotations of the
/// tracked frames. A gyroscope that contradicts them, such as one that measures degrees, is left
/// out; if it is only mounted otherwise, its orientation is estimated.
class GyroPrior {
 public:
  explicit GyroPrior(std::optional<Imu> imu) : imu_(std::move(imu)) {
    if (imu_) bias_.emplace(*imu_);
  }

  /// Returns the rotation from the previous frame to this one; the translation is not known. None
  /// without samples for that time, or while they are left out.
  /// @param before      time of the previous frame [s]
  /// @param covariance  of the previous pose, as PoseEstimate's
  std::optional<MotionPrior> motion(const RgbdFrame& image, double before,
                                    const Matrix6d& covariance);

  /// Compares rotations, clocks and orientation of the frame of motion(). Returns the IMU as it is
  /// mounted, if it was found to be mounted otherwise.
  /// @param T_previous_camera  motion since the previous frame as the images alone show it
  /// @param covariance         of the pose of this frame by them, as PoseEstimate's
  std::optional<Imu> compare(const RgbdFrame& image, const Pose& T_previous_camera,
                             const Matrix6d& covariance);

  /// Returns whether it is left out because it contradicts the images, or their clock.
  bool contradicted() const { return contradictions_.too_many() || clock_.offset().has_value(); }

  /// Returns the finding that it is mounted otherwise, or was left out in a fifth of the frames or
  /// more; none otherwise.
  std::optional<Finding> finding() const;

 private:
  Eigen::Matrix3d with_bias(const Eigen::Matrix3d& covariance) const;
  void compare_rotation(const Eigen::Quaterniond& seen, const Matrix6d& of_images);
  std::optional<Imu> mounted_otherwise();
  Finding mounting_finding() const;

  std::optional<Imu> imu_;
  std::optional<GyroBias> bias_;
  std::optional<Preintegration> measured_;  // up to the frame of motion()
  double before_ = 0;                       // time of its begin [s]
  Eigen::Matrix3d covariance_ =
      Eigen::Matrix3d::Zero();  // of it and of the previous pose, in the IMU
  // Of the frames in which the camera turns. In starts among people mostly two or fewer contradict
  // a right gyroscope; with 6 or 8, those with wrong axes, sign or unit do up to ten times the
  // harm.
  Contradictions contradictions_{60, 4};
  GyroClock clock_;
  GyroMounting mounting_;
  std::optional<Eigen::Quaterniond> given_;  // orientation that is not used
  std::size_t compared_ = 0, left_out_ = 0;  // frames
};

}  // namespace stillmap
