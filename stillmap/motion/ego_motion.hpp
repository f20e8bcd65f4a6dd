// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <cstdint>
#include <vector>

namespace stillmap {

/// The camera's motion before it is known what moves in the newest frame: from what was static up
/// to the frame before. And how that frame's keypoints go on.
struct EgoMotion {
  Pose T_world_camera;    ///< of the newest frame, roughly
  Pose T_world_previous;  ///< of the frame before, in the same world
  /// Per keypoint of the newest frame: the keypoint of the frame before that it goes on from,
  /// moving or not; -1: none.
  std::vector<std::int32_t> previous;
  /// Per keypoint: what earlier frames say of the landmark it is believed to show, as log-odds of
  /// being static; 0: it shows none.
  std::vector<float> landmark_log_odds;
};

}  // namespace stillmap
