// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

#include <span>

namespace stillmap {

struct FusionOptions {
  int neighbors = 10;          ///< covisible keyframes to fuse with
  double radius = 3.0;         ///< search radius around the projection [pixels at level 0]
  int max_distance = 50;       ///< Hamming distance of two views of one thing
  double max_disparity = 1.0;  ///< disagreement of seen and predicted disparity [pixels]
  double min_view_cosine =
      0.5;  ///< between the landmark's mean viewing direction and the present one
  STILLMAP_FIELDS(neighbors, radius, max_distance, max_disparity, min_view_cosine)
};

/// Looks for landmarks in a keyframe. A keypoint that shows nothing yet gains the landmark; where
/// it shows another one, the two are merged into the one with more observations. Returns how many
/// observations were gained or landmarks merged.
/// @param landmarks  unknown ids are passed over
int fuse_into(Map& map, KeyframeId keyframe, std::span<const LandmarkId> landmarks,
              const FusionOptions& options);

}  // namespace stillmap
