// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/fusion.hpp"

namespace stillmap {

/// Fuses duplicate landmarks: the neighbors' landmarks are searched in the keyframe and the
/// keyframe's in its neighbors. A keypoint without a landmark gains an observation; a keypoint that
/// shows another landmark causes a merge into the landmark with more observations. Returns the
/// number of gained observations and merged landmarks.
int fuse_duplicates(Map& map, KeyframeId keyframe, const FusionOptions& options);

}  // namespace stillmap
