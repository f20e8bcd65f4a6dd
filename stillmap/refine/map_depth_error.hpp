// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/bundle_adjustment.hpp"

#include <optional>

namespace stillmap {

/// Returns the error of the depths that landmarks show which keyframes of this session see in
/// different parts of their images, beyond Map::depth_error(): see fit_depth_error().
std::optional<SmoothDepthError> depth_error_of(const Map& map);

/// Puts the depths as measured into a bundle of the map's keyframes.
void restore_measured_depths(const Map& map, BundleProblem& problem);

}  // namespace stillmap
