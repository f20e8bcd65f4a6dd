// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

namespace stillmap {

struct LandmarkCreationOptions {
  double max_depth = 6.0;  ///< meters; beyond, a Kinect's depth is worse than triangulation
  int triangulation_neighbors = 5;  ///< keyframes to triangulate with
  double min_parallax = 1.0;        ///< degrees between the two rays
  int max_distance = 50;            ///< Hamming distance of a match across keyframes
  double max_error = 2.0;           ///< reprojection error in each view [pixels at level 0]
  STILLMAP_FIELDS(max_depth, triangulation_neighbors, min_parallax, max_distance, max_error)
};

/// Makes a landmark of every static keypoint that has a depth and shows nothing yet. Returns how
/// many.
int create_from_depth(Map& map, KeyframeId keyframe, const LandmarkCreationOptions& options);

/// Makes landmarks of keypoints without depth that a covisible keyframe sees too, from enough to
/// the side (midpoint of the two rays, checked by its reprojection in both views; Hartley and
/// Zisserman, Multiple View Geometry, 2003, section 12.2). Returns how many.
int create_by_triangulation(Map& map, KeyframeId keyframe, const LandmarkCreationOptions& options);

}  // namespace stillmap
