// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/motion_compensation.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <Eigen/Core>

namespace stillmap {

/// Estimates the timing of a camera's shutters from tracked frames.
///
/// Landmarks at rest project to rows that are exposed at different times. The residuals of a frame
/// that are proportional to the camera's velocity and to the row show the readout time; those of
/// the depth proportional to its change along the image motion show the delay of the depth image.
/// Both are estimated together with the frame's pose (8 unknowns), and the estimates of all frames
/// are averaged by their information. The timing is used once it is certain.
class ShutterCalibration {
 public:
  /// Adds a tracked frame.
  /// @param recorded features before motion compensation
  /// @param estimate pose of the frame, whose features were compensated with timing()
  void add(const TrackingModel& model, const RgbdFrame& image, const Features& recorded,
           const Vector6d& twist, const PoseEstimate& estimate);

  /// Returns the timing in use.
  const ShutterTiming& timing() const { return timing_; }

 private:
  void update();

  ShutterTiming timing_;
  // Of the corrections of the timing since it changed.
  Eigen::Matrix2d information_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted_sum_ = Eigen::Vector2d::Zero();
  double squares_ = 0;
  int frames_ = 0;
};

}  // namespace stillmap
