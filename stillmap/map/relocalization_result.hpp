// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"

#include <vector>

namespace stillmap {

/// Result of a relocalization, handed from mapping to the tracker.
struct RelocalizationResult {
  FramePtr frame;         ///< Frame that was relocalized; the camera has moved on since.
  LocalMapPtr local_map;  ///< Local map snapshot around the recognized keyframe.
  /// Pose of the frame relative to local_map->reference; stays valid when the map is corrected.
  Pose T_reference_camera;
  /// One per keypoint: the landmark that it shows, or an invalid id.
  std::vector<LandmarkId> landmarks;
  int inliers = 0;  ///< Number of keypoints that show a landmark.
};

}  // namespace stillmap
