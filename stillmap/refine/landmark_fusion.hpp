// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Fuses duplicate landmarks: the neighbors' landmarks are searched in the keyframe and the
/// keyframe's in its neighbors. A keypoint without a landmark gains an observation; a keypoint that
/// shows another landmark causes a merge into the landmark with more observations. Returns the
/// number of gained observations and merged landmarks.
/// @param most maximum number of neighbors: the covisible keyframes that share most landmarks
int fuse_duplicates(Map& map, KeyframeId keyframe, int most);

}  // namespace stillmap
