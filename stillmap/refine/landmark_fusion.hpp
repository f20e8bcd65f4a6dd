// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

namespace stillmap {

struct FusionOptions {
  int neighbours = 10;         ///< covisible keyframes to fuse with
  double radius = 3.0;         ///< search radius around the projection [pixels at level 0]
  int max_distance = 50;       ///< Hamming distance of two views of one thing
  double max_disparity = 1.0;  ///< disagreement of seen and predicted disparity [pixels]
  double min_view_cosine =
      0.5;  ///< between the landmark's mean viewing direction and the present one
  STILLMAP_FIELDS(neighbours, radius, max_distance, max_disparity, min_view_cosine)
};

/// Joins landmarks that are one thing: those of the neighbours are looked for in the keyframe, and
/// the keyframe's in its neighbours. A keypoint that shows nothing yet gains the landmark; where it
/// shows another one, the two are merged into the one with more observations. Yields how many
/// observations were gained or landmarks merged.
int fuse_duplicates(Map& map, KeyframeId keyframe, const FusionOptions& options);

}  // namespace stillmap
