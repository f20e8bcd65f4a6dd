// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Creates a landmark for every static keypoint with a depth and without a landmark. Returns the
/// number of new landmarks.
/// @param max_sigma  largest standard deviation of the depth [m]
/// @param fewest     number of nearest keypoints that get a landmark whatever their depth
int create_from_depth(Map& map, KeyframeId keyframe, double max_sigma, std::size_t fewest = 0);

/// Creates landmarks for keypoints without a depth of standard deviation up to `max_sigma` [m] that
/// are matched in a covisible keyframe with sufficient parallax (midpoint of the two rays, checked
/// by reprojection in both views; Hartley and Zisserman, Multiple View Geometry, 2003,
/// section 12.2). Returns the number of new landmarks.
int create_by_triangulation(Map& map, KeyframeId keyframe, double max_sigma);

}  // namespace stillmap
