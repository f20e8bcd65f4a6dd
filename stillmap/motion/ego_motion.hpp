// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <cstdint>
#include <vector>

namespace stillmap {

/// The camera's motion as estimated from the keypoints that were static up to the previous frame,
/// before the newest frame has motion labels.
struct EgoMotion {
  Pose T_odometry_camera;    ///< Initial pose of the newest frame, see TrackedFrame.
  Pose T_odometry_previous;  ///< Pose of the previous frame.
  /// Per keypoint of the newest frame: index of the matched keypoint of the previous frame, static
  /// or moving; -1 for none.
  std::vector<std::int32_t> previous;
  /// Per keypoint: static log-odds of the matched landmark from earlier frames; 0 for none.
  std::vector<float> landmark_log_odds;
};

}  // namespace stillmap
