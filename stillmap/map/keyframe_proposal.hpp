// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/motion/frame.hpp"

#include <vector>

namespace stillmap {

/// How often the tracker expected to see a landmark, and did; and whether it moves.
struct VisibilityCount {
  LandmarkId landmark;
  std::uint32_t predicted = 0, found = 0;
  float static_log_odds = 0;  ///< by all frames so far
};

/// What the tracker hands to the mapper: "keep this frame".
struct KeyframeProposal {
  FramePtr frame;
  /// The keyframe the pose is relative to; invalid for the first one of a new map, whose pose is
  /// then given in the world.
  KeyframeId reference;
  Pose T_reference_camera;
  std::vector<LandmarkId>
      landmarks;  ///< per keypoint: what it shows; invalid where nothing is known
  std::vector<VisibilityCount>
      visibility_counts;  ///< since the proposal before; a landmark may come several times
  /// With the first one of a new map: a keyframe of the one before, if that held the camera too
  /// briefly to be kept; else invalid.
  KeyframeId abandoned = {};
};

}  // namespace stillmap
