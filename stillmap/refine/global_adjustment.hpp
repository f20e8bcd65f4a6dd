// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/refine/map_bundle.hpp"

namespace stillmap {

/// Every keyframe of a component, its first one held, and the landmarks that two of them see at
/// least: what only one has seen says nothing of the cameras.
MapBundle whole_component(const Map& map, std::uint32_t component);

/// Takes in the solution for a whole component, into a map that has grown meanwhile: keyframes that
/// are not in the bundle move along with the one of it that they share most landmarks with, or
/// through others that do (the spanning tree: Mur-Artal and Tardos, ORB-SLAM2, TRO 2017, section
/// III.D); landmarks that are not, with the keyframe that saw them first.
void apply_to_grown_map(Map& map, const MapBundle& bundle, const BundleResult& result);

/// Both at once, in a map that stands still meanwhile.
BundleResult adjust_globally(Map& map, std::uint32_t component, const BundleOptions& options,
                             const StopRequest& stop = {});

}  // namespace stillmap
