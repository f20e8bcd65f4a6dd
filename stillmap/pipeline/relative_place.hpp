// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// A pose relative to a keyframe of the map, with which it moves.
struct RelativePlace {
  KeyframeId keyframe;
  Pose T_keyframe_camera;
};

}  // namespace stillmap
