// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Thresholds as in ORB-SLAM (Mur-Artal, Montiel and Tardos, TRO 2015, sections VI.B and VI.E).
struct CullingOptions {
  /// Minimum share of the frames that expected a landmark in which it was matched [0..1].
  double min_found_share = 0.25;
  /// Landmarks with lower static log-odds (P(static) < 1/4) are culled.
  double min_static_log_odds = -1.1;
  /// Number of keyframes after which a new landmark needs `min_observations`.
  int trial_keyframes = 2;
  int min_observations = 2;  ///< Minimum number of observations after the trial period.
  /// Share of a keyframe's landmarks observed as closely by `redundant_observers` others above
  /// which it is culled [0..1].
  double redundant_share = 0.9;
  /// Number of other keyframes that must observe a landmark as closely.
  int redundant_observers = 3;
  int keep_newest = 3;  ///< Number of newest keyframes that are never culled.
  STILLMAP_FIELDS(min_found_share, min_static_log_odds, trial_keyframes, min_observations,
                  redundant_share, redundant_observers, keep_newest)
};

/// Erases unreliable landmarks near the newest keyframe. Returns the number of culled landmarks.
int cull_landmarks(Map& map, KeyframeId newest, const CullingOptions& options);

/// Erases redundant neighbors of the newest keyframe, but never a component's first keyframe.
/// Returns the number of culled keyframes.
int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options);

}  // namespace stillmap
