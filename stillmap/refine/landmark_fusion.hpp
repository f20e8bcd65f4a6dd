// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/fusion.hpp"

namespace stillmap {

/// Joins landmarks that are one thing: those of the neighbors are looked for in the keyframe, and
/// the keyframe's in its neighbors. A keypoint that shows nothing yet gains the landmark; where it
/// shows another one, the two are merged into the one with more observations. Returns how many
/// observations were gained or landmarks merged.
int fuse_duplicates(Map& map, KeyframeId keyframe, const FusionOptions& options);

}  // namespace stillmap
