// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

#include <span>

namespace stillmap {

struct FusionOptions {
  int neighbors = 10;   ///< Number of covisible keyframes whose landmarks are fused.
  double radius = 3.0;  ///< Search radius around the projection [pixels at level 0].
  /// Maximum Hamming distance between two descriptors of one landmark [bits].
  int max_distance = 50;
  /// Maximum difference between measured and predicted disparity [pixels].
  double max_disparity = 1.0;
  /// Minimum cosine of the angle between mean and current viewing direction.
  double min_view_cosine = 0.5;
  STILLMAP_FIELDS(neighbors, radius, max_distance, max_disparity, min_view_cosine)
};

/// Searches for landmarks in a keyframe. A keypoint without a landmark gains an observation; a
/// keypoint that shows another landmark causes a merge into the landmark with more observations.
/// Returns the number of gained observations and merged landmarks.
/// @param landmarks  unknown ids are ignored
int fuse_into(Map& map, KeyframeId keyframe, std::span<const LandmarkId> landmarks,
              const FusionOptions& options);

}  // namespace stillmap
