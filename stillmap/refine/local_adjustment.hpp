// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

namespace stillmap {

struct LocalAdjustmentOptions {
  int max_free = 15;  ///< Maximum number of optimized keyframes: the newest and its best neighbors.
  BundleOptions bundle;
};

/// Local bundle adjustment of the newest keyframe, its neighbors and all their landmarks. Removes
/// outlier observations and refreshes the landmarks. The rest of the map stays unchanged. Returns
/// the solver's result.
BundleResult adjust_locally(Map& map, KeyframeId newest, const LocalAdjustmentOptions& options,
                            const StopRequest& stop = {});

}  // namespace stillmap
