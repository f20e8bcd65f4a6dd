// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/refine/map_bundle.hpp"

namespace stillmap {

/// Returns the bundle of all keyframes of a component, with its first one fixed, and all landmarks
/// with at least two observations; a single observation does not constrain the cameras.
MapBundle whole_component(const Map& map, std::uint32_t component);

/// Applies the solution to a map that has grown since. Keyframes that are not in the bundle move
/// with the bundle's keyframe that they share most landmarks with, directly or through others (the
/// spanning tree: Mur-Artal and Tardos, ORB-SLAM2, TRO 2017, section III.D); landmarks that are not
/// in the bundle move with the first keyframe that observed them.
void apply_to_grown_map(Map& map, const MapBundle& bundle, const BundleResult& result);

/// Optimizes a whole component at once, in a map that does not change meanwhile.
BundleResult adjust_globally(Map& map, std::uint32_t component);

}  // namespace stillmap
