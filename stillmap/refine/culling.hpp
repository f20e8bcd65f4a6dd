// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Thresholds as in ORB-SLAM (Mur-Artal, Montiel and Tardos, TRO 2015, sections VI.B and VI.E).
struct CullingOptions {
  /// Number of keyframes after which a new landmark needs two observations.
  int trial_keyframes = 2;
};

/// Erases unreliable landmarks near the newest keyframe. Returns the number of culled landmarks.
int cull_landmarks(Map& map, KeyframeId newest, const CullingOptions& options);

/// Erases redundant neighbors of the newest keyframe, but never a component's first keyframe.
/// Returns the number of culled keyframes.
int cull_keyframes(Map& map, KeyframeId newest);

}  // namespace stillmap
