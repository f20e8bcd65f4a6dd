// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

namespace stillmap {

/// Local bundle adjustment of the newest keyframe, its neighbors and all their landmarks. Removes
/// outlier observations and refreshes the landmarks. The rest of the map stays unchanged. Returns
/// the solver's result.
/// @param max_free maximum number of optimized keyframes: the newest and its best neighbors
BundleResult adjust_locally(Map& map, KeyframeId newest, int max_free,
                            const StopRequest& stop = {});

}  // namespace stillmap
