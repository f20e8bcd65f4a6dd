// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace stillmap {

/// Filters the poses of a camera while it moves: the poses handed out during a run, which later
/// frames cannot correct, jitter less.
///
/// The model is that of smooth_trajectory(), on the poses of the last seconds, without a look
/// ahead. The noise of poses and accelerations is estimated along the way: with each pose one other
/// noise is tried and kept if the poses are more likely with it (Harvey 1989, section 3.4).
class TrajectoryFilter {
 public:
  /// Adds the next pose, in the same world as the last one. Returns the filtered T_world_camera;
  /// the pose itself if it has no covariance or follows fewer than ten others.
  Pose add(const UncertainPose& pose);

  /// Moves the earlier poses along with a correction of the map.
  void move(const Pose& T_corrected_world);
  /// Forgets the path: the next pose is in another world, or the camera was lost before it. The
  /// noise is kept.
  void reset() { poses_.clear(); }

 private:
  std::vector<UncertainPose> poses_;     // the newest last
  std::array<double, 3> logs_{};         // logarithms of the noise
  std::array<double, 3> step_{2, 2, 2};  // of the logarithms, negative if a decrease is tried next
  std::size_t trial_ = 0;                // index of the logarithm that is tried next
};

}  // namespace stillmap
