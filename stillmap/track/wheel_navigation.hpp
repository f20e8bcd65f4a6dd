// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/inertial/contradictions.hpp"

#include <deque>
#include <optional>
#include <span>

namespace stillmap {

/// Pose of a camera by the wheels of the robot that carries it, since the last pose that its images
/// gave. Wheels that slip contradict the images, and are then not used.
class WheelNavigation {
 public:
  explicit WheelNavigation(const Wheels& wheels) : wheels_(wheels) {}

  /// Moves the pose to the time of a frame. Without samples around both times, where they jump, and
  /// before the first pose, there is none afterwards.
  /// @param samples  by increasing time
  void propagate(std::span<const OdometrySample> samples, double timestamp);

  /// Takes the pose of the frame by its images.
  /// @param same_world  whether it is in the world of the poses before
  void correct(const UncertainPose& pose, bool same_world);

  /// Moves the pose along with a correction of the map.
  void move(const Pose& T_corrected_world) {
    for (Start& start : starts_)
      start.pose.T_world_camera = T_corrected_world * start.pose.T_world_camera;
  }

  /// Returns the pose of the camera at the time of the newest frame, with its covariance; none
  /// without one, and while the wheels contradict the images.
  std::optional<UncertainPose> pose() const;
  /// Returns the same pose from an earlier one by the images, up to half a second before: a motion
  /// that is long enough to tell that of somebody near the camera from the camera's.
  std::optional<UncertainPose> pose_since_earlier() const;
  /// Returns whether the wheels contradict the images.
  bool contradicted() const { return contradictions_.too_many(); }

 private:
  /// Motion by the wheels since a pose.
  struct Motion {
    Pose T_start_camera;
    double length = 0, angle = 0;  // of the path [m], [rad]
  };
  /// A pose by the images and the motion since.
  struct Start {
    UncertainPose pose;
    Motion since;
  };
  Eigen::Matrix<double, 6, 6> covariance(const Motion& motion) const;
  UncertainPose moved(const Start& start) const;
  void compare(const UncertainPose& pose);

  Wheels wheels_;
  double timestamp_ = 0;                 // of the newest frame [s]
  std::deque<Start> starts_;             // of half a second, the newest last
  std::optional<Start> compared_;        // an earlier one
  Contradictions contradictions_{5, 2};  // of the comparisons
};

}  // namespace stillmap
