// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <vector>

namespace stillmap::simulate {

/// The motion of a camera by a recorded trajectory, as a uniform cubic B-spline: velocity and
/// acceleration are continuous, as an IMU measures them. Its control points are means of the poses
/// within 25 ms, which removes the noise of a motion capture system; without poses in between, the
/// recording is interpolated linearly.
class RecordedPath {
 public:
  /// @param trajectory  at least two poses
  explicit RecordedPath(const Trajectory& trajectory);

  /// Returns T_first_camera at a time since the first pose [s]; before it and after the last one
  /// the camera rests.
  Pose at(double seconds) const;
  double duration() const { return duration_; }  ///< [s]

 private:
  double duration_;
  std::vector<Pose> knots_;  // T_first_camera, kKnotInterval apart, from one before the first pose
};

/// Reads a trajectory with read_trajectory(). Throws Error, also for fewer than two poses.
RecordedPath read_path(const std::filesystem::path& file);

}  // namespace stillmap::simulate
