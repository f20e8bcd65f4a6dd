// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/inertial/contradictions.hpp"
#include "stillmap/inertial/inertial_navigation.hpp"

#include <optional>
#include <span>

namespace stillmap {

/// Pose of the camera by its IMU that the images of the last quarter to half a second did not
/// correct. In that time a wrong accelerometer, or somebody near whose motion was taken for the
/// camera's, moves it by more than its standard deviation; from frame to frame they do not.
class InertialPrediction {
 public:
  /// Moves the pose to the time of a frame, as InertialNavigation.
  void propagate(std::span<const ImuSample> samples, double timestamp);

  /// Compares with the pose of the frame by its images.
  /// @param navigation  that this pose corrected
  void compare(const UncertainPose& pose, const InertialNavigation& navigation);

  /// Moves the pose along with a correction of the map.
  void move(const Pose& T_corrected_world);

  /// Forgets the states, in a new world.
  void reset();

  /// Returns the pose of the camera at the newest frame; none in the first quarter of a second, and
  /// where InertialNavigation has none.
  std::optional<UncertainPose> pose() const;

  /// Returns whether the images contradict the poses.
  bool contradicted() const { return contradictions_.too_many(); }

 private:
  std::optional<InertialNavigation> older_, newer_;
  double renewed_ = 0;                   // time of the start of `newer_` [s]
  Contradictions contradictions_{8, 2};  // of the comparisons
};

}  // namespace stillmap
