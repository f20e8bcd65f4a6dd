// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"

#include <vector>

namespace stillmap {

/// Where a lost camera was, by what it saw: what the map's side hands to the tracker.
struct RelocalizationResult {
  FramePtr frame;           ///< that was recognized; the camera has moved on since
  LocalMapPtr local_map;    ///< around the place
  Pose T_reference_camera;  ///< of the frame, relative to local_map->reference; holds while the map
                            ///< moves
  std::vector<LandmarkId>
      landmarks;    ///< per keypoint: what it shows; invalid where nothing is known
  int inliers = 0;  ///< keypoints that show a landmark
};

}  // namespace stillmap
