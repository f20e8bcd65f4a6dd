// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Thresholds as in ORB-SLAM (Mur-Artal, Montiel and Tardos, TRO 2015, sections VI.B and VI.E).
struct CullingOptions {
  double min_found_share =
      0.25;  ///< of the frames that should have seen a landmark, those that did
  double min_static_log_odds = -1.1;  ///< a landmark less likely static than 1 in 4 goes
  int trial_keyframes = 2;            ///< keyframes after which a landmark must have been seen
  int min_observations = 2;           ///< by so many
  double redundant_share =
      0.9;  ///< of a keyframe's landmarks seen by three others as closely: it may go
  int redundant_observers = 3;  ///< what "three others" means
  int keep_newest = 3;          ///< keyframes never culled
  STILLMAP_FIELDS(min_found_share, min_static_log_odds, trial_keyframes, min_observations,
                  redundant_share, redundant_observers, keep_newest)
};

/// Erases landmarks near the newest keyframe that did not prove themselves. Returns how many.
int cull_landmarks(Map& map, KeyframeId newest, const CullingOptions& options);

/// Erases neighbors of the newest keyframe whose landmarks are nearly all seen, as closely, by
/// enough others; never a component's first one. Returns how many.
int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options);

}  // namespace stillmap
