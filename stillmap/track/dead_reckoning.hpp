// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/inertial/inertial_navigation.hpp"
#include "stillmap/inertial/inertial_prediction.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"
#include "stillmap/track/wheel_navigation.hpp"

#include <optional>
#include <vector>

namespace stillmap {

/// Pose of the camera without its images, by the IMU and the wheels that it has.
class DeadReckoning {
 public:
  explicit DeadReckoning(const Camera& camera);

  /// Moves the pose to the time of the next frame.
  /// @param gyro_contradicted  whether the gyroscope contradicts the images, by which the
  ///                           accelerations are turned, so that these are of no use either
  void propagate(const RgbdFrame& image, bool gyro_contradicted = false);
  /// Takes the pose of this frame by its images.
  /// @param same_world  whether it is in the world of the poses before
  void correct(const UncertainPose& pose, bool same_world);
  /// Corrects the velocity of a pose without wheels by what the images show of an unknown place.
  /// @param error  velocity by the images minus that of the pose, in the world [m/s]
  void correct_velocity(const Eigen::Vector3d& error);
  /// Begins again with an IMU that is mounted otherwise.
  void mount(const Imu& imu);
  /// Moves the pose along with a correction of the map.
  void move(const Pose& T_corrected_world);

  /// Returns the pose at the newest frame; none without IMU and wheels, while these contradict the
  /// images, and where its standard deviation is above half a meter or 0.15 rad.
  std::optional<UncertainPose> pose() const;
  /// Returns the pose that the images of the newest frame are expected to show; none as for pose().
  std::optional<UncertainPose> expected() const;
  /// Returns the upward direction in the camera, by the accelerometer: see InertialNavigation.
  std::optional<Eigen::Vector3d> up_in_camera() const;
  /// Returns whether the wheels give the motion. Agreement with them confirms a pose, unlike that
  /// with inertia alone, whose velocity the images correct.
  bool by_wheels() const { return wheels_ && wheels_->pose(); }
  /// Returns the standard deviation of the velocity of pose() [m/s].
  double velocity_sigma() const;

  /// Returns the findings that the accelerometer or the wheels contradict the images in most
  /// frames, or that most frames have no samples.
  std::vector<Finding> findings() const;

 private:
  bool is_inertia_contradicted() const;
  bool by_inertia() const;

  std::optional<InertialNavigation> inertia_;
  InertialPrediction prediction_;  // of inertia_
  bool gyro_contradicted_ = false;
  std::optional<WheelNavigation> wheels_;
  std::size_t compared_ = 0, inertia_left_out_ = 0, wheels_left_out_ = 0;  // frames
  std::size_t frames_ = 0, without_imu_ = 0, without_odometry_ = 0;
};

/// Returns whether a map may be continued at a pose: its standard deviation is at most half of the
/// drift up to which loops are closed (DriftLimits).
bool is_certain(const UncertainPose& pose);

}  // namespace stillmap
