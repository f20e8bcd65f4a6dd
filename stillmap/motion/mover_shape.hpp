// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/motion/mover_detection.hpp"
#include "stillmap/motion/mover_regions.hpp"

namespace stillmap {

/// Measures position, boxes, spans and visibility of a region; see MoverDetector for their meaning.
void measure_shape(const MoverRegion& region, const MoverGrid& grid, const Pose& T_world_camera,
                   MoverDetection& detection);

/// Returns whether a region is too large and too compact to be noise.
bool is_object(const MoverRegion& region, const MoverGrid& grid);

}  // namespace stillmap
