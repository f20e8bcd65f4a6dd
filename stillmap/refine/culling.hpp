// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Erases unreliable landmarks near the newest keyframe (Mur-Artal, Montiel and Tardos, TRO 2015,
/// section VI.B). Returns the number of culled landmarks.
int cull_landmarks(Map& map, KeyframeId newest);

/// Erases redundant neighbors of the newest keyframe, but never a component's first keyframe.
/// Returns the number of culled keyframes.
int cull_keyframes(Map& map, KeyframeId newest);

/// Erases all redundant keyframes but the first of each component, in creation order. Returns the
/// number of culled keyframes.
int cull_keyframes(Map& map);

}  // namespace stillmap
