// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

#include <optional>

namespace stillmap {

/// Returns the focal length fx [pixels] that fits the map best, if it shows for certain that the
/// camera's is wrong: see is_wrong_focal_length(); otherwise none, also if the map is too small to
/// tell. Found by calibrate_camera() from the first 60 keyframes of the largest component. The map
/// was made with the wrong value, so the estimate makes up only half to nine tenths of the error.
std::optional<double> contradicting_focal_length(const Map& map);

}  // namespace stillmap
