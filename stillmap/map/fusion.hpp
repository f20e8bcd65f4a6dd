// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

#include <span>

namespace stillmap {

/// Searches for landmarks in a keyframe. A keypoint without a landmark gains an observation; a
/// keypoint that shows another landmark causes a merge into the landmark with more observations.
/// Returns the number of gained observations and merged landmarks.
/// @param landmarks unknown ids are ignored
/// @param radius    search radius around the projection [pixels at level 0]
int fuse_into(Map& map, KeyframeId keyframe, std::span<const LandmarkId> landmarks, double radius);

}  // namespace stillmap
