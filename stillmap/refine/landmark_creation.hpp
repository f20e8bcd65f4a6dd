// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

namespace stillmap {

struct LandmarkCreationOptions {
  int triangulation_neighbors = 5;  ///< Number of covisible keyframes used for triangulation.
  double min_parallax = 1.0;        ///< Minimum angle between the two rays [degrees].
  int max_distance = 50;   ///< Maximum Hamming distance of a match across keyframes [bits].
  double max_error = 2.0;  ///< Maximum reprojection error in each view [pixels at level 0].
  STILLMAP_FIELDS(triangulation_neighbors, min_parallax, max_distance, max_error)
};

/// Creates a landmark for every static keypoint with a depth and without a landmark. Returns the
/// number of new landmarks.
int create_from_depth(Map& map, KeyframeId keyframe);

/// Creates landmarks for keypoints without depth that a covisible keyframe with sufficient parallax
/// shows too (midpoint of the two rays, checked by reprojection in both views; Hartley and
/// Zisserman, Multiple View Geometry, 2003, section 12.2). Returns the number of new landmarks.
int create_by_triangulation(Map& map, KeyframeId keyframe, const LandmarkCreationOptions& options);

}  // namespace stillmap
