// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

#include <span>

namespace stillmap {

struct FusionOptions {
  int neighbors = 10;   ///< Number of covisible keyframes whose landmarks are fused.
  double radius = 3.0;  ///< Search radius around the projection [pixels at level 0].
};

/// Searches for landmarks in a keyframe. A keypoint without a landmark gains an observation; a
/// keypoint that shows another landmark causes a merge into the landmark with more observations.
/// Returns the number of gained observations and merged landmarks.
/// @param landmarks  unknown ids are ignored
int fuse_into(Map& map, KeyframeId keyframe, std::span<const LandmarkId> landmarks,
              const FusionOptions& options);

}  // namespace stillmap
