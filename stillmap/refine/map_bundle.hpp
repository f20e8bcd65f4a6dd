// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

#include <utility>
#include <vector>

namespace stillmap {

/// A part of the map as a bundle adjustment problem: a copy, so that it can be solved elsewhere
/// while the map goes on.
struct MapBundle {
  std::vector<KeyframeId> keyframes;  ///< one per pose of the problem, free ones first
  std::size_t free = 0;
  std::vector<LandmarkId> landmarks;                            ///< one per point
  std::vector<std::pair<LandmarkId, KeyframeId>> observations;  ///< one per observation
  BundleProblem problem;
};

/// @param keyframes  the first `free` of them move
/// @param landmarks  with their observations by these keyframes
MapBundle make_bundle(const Map& map, const std::vector<KeyframeId>& keyframes, std::size_t free,
                      const std::vector<LandmarkId>& landmarks);

/// Moves keyframes and landmarks to where the solver has them, takes back observations that do not
/// fit, and brings the landmarks' descriptors and directions up to date. What the map no longer
/// holds is passed over.
void apply(Map& map, const MapBundle& bundle, const BundleResult& result);

}  // namespace stillmap
