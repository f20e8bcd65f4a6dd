// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

namespace stillmap {

struct LocalAdjustmentOptions {
  int max_free = 15;    ///< keyframes that move: the newest and its best neighbors
  int max_fixed = 30;   ///< keyframes that see their landmarks too, and hold the window in place
  int min_shared = 15;  ///< landmarks that make a neighbor
  BundleOptions bundle;
  STILLMAP_FIELDS(max_free, max_fixed, min_shared, bundle)
};

/// Adjusts the newest keyframe, its neighbors and all their landmarks to one another, takes back
/// observations that do not fit, and brings the landmarks' descriptors and directions up to date.
/// The rest of the map stays as it is. Returns what the solver said.
BundleResult adjust_locally(Map& map, KeyframeId newest, const LocalAdjustmentOptions& options,
                            const StopRequest& stop = {});

}  // namespace stillmap
