// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Creates a landmark for every static keypoint with a depth and without a landmark. Returns the
/// number of new landmarks.
/// @param max_sigma largest standard deviation of a depth that places a landmark [m]
/// @param fewest    number of the nearest keypoints that place one in any case
int create_from_depth(Map& map, KeyframeId keyframe, double max_sigma, std::size_t fewest = 0);

/// Creates landmarks for keypoints without such a depth that a covisible keyframe with sufficient
/// parallax shows too (midpoint of the two rays, checked by reprojection in both views; Hartley and
/// Zisserman, Multiple View Geometry, 2003, section 12.2). Returns the number of new landmarks.
int create_by_triangulation(Map& map, KeyframeId keyframe, double max_sigma);

}  // namespace stillmap
