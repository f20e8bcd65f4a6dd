// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

#include <utility>
#include <vector>

namespace stillmap {

/// A part of the map as a bundle adjustment problem: a copy that can be solved in another thread.
struct MapBundle {
  std::vector<KeyframeId> keyframes;  ///< One per pose of the problem, optimized ones first.
  std::size_t free = 0;               ///< Number of optimized keyframes.
  std::vector<LandmarkId> landmarks;  ///< One per point of the problem.
  /// One per observation of the problem.
  std::vector<std::pair<LandmarkId, KeyframeId>> observations;
  BundleProblem problem;
};

/// @param keyframes  the first `free` of them are optimized
/// @param landmarks  their observations by these keyframes are included
MapBundle make_bundle(const Map& map, const std::vector<KeyframeId>& keyframes, std::size_t free,
                      const std::vector<LandmarkId>& landmarks);

/// Applies the solution to the map, removes outlier observations, and refreshes the landmarks.
/// Keyframes and landmarks that the map no longer contains are ignored.
void apply(Map& map, const MapBundle& bundle, const BundleResult& result);

}  // namespace stillmap
