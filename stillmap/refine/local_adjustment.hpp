// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

namespace stillmap {

struct LocalAdjustmentOptions {
  int max_free = 15;  ///< Maximum number of optimized keyframes: the newest and its best neighbors.
  int max_fixed = 30;   ///< Maximum number of fixed keyframes that observe the same landmarks.
  int min_shared = 15;  ///< Minimum number of shared landmarks of a neighbor.
  BundleOptions bundle;
  STILLMAP_FIELDS(max_free, max_fixed, min_shared, bundle)
};

/// Local bundle adjustment of the newest keyframe, its neighbors and all their landmarks. Removes
/// outlier observations and refreshes the landmarks. The rest of the map stays unchanged. Returns
/// the solver's result.
BundleResult adjust_locally(Map& map, KeyframeId newest, const LocalAdjustmentOptions& options,
                            const StopRequest& stop = {});

}  // namespace stillmap
