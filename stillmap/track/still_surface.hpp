// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracked_frame.hpp"

#include <optional>

#include <Eigen/Core>

namespace stillmap {

/// Recognizes that what a lost camera sees stands still: its points move as those of static
/// surfaces do with the motion of the camera that an IMU or wheels measure.
class StillSurface {
 public:
  /// Adds the next frame with its pose. If what it shows has stood still for a third of a second,
  /// returns the velocity of the camera relative to it minus that of the poses, in the world [m/s].
  /// @param velocity_sigma  standard deviation of the velocity of the poses [m/s]
  std::optional<Eigen::Vector3d> add(const TrackingModel& model, const FramePtr& frame,
                                     const Pose& T_world_camera, double velocity_sigma);

  /// Forgets the frames: the camera is not lost any more.
  void reset() { first_.reset(); }

 private:
  FramePtr first_;  // null before the first frame
  Pose T_world_first_;
};

}  // namespace stillmap
