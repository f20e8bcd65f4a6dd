// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace stillmap {

/// An image with or without a keyframe.
struct ImageView {
  const Features& features;
  std::span<const float> static_weight;  ///< one per keypoint: 0 or less is left out
};

struct GuidedSearchOptions {
  double radius = 8;             ///< of the search on level 0 [pixels]
  int max_distance = 60;         ///< Hamming, inclusive
  double ratio = 0.9;            ///< see ProjectionMatchOptions
  double min_view_cosine = 0.5;  ///< between a landmark's mean viewing direction and this one
  STILLMAP_FIELDS(radius, max_distance, ratio, min_view_cosine)
};

/// "Keypoint `keypoint` shows landmark `landmark`."
struct LandmarkMatch {
  std::uint32_t keypoint = 0;
  LandmarkId landmark;
  bool operator==(const LandmarkMatch&) const = default;
};

/// Where a landmark should be seen [pixels], and whether it is.
struct ExpectedLandmark {
  float u = 0, v = 0;
  bool found = false;
};

/// What a camera at a supposed pose should see, and does.
struct GuidedSearch {
  std::vector<LandmarkMatch> matches;  ///< sorted by landmark; keypoints are different
  /// Landmarks that should be seen: in the image, from where they can be seen, and not behind what
  /// the keypoints beside them show.
  std::vector<ExpectedLandmark> expected;
};

/// Looks for landmarks around their projections.
/// @param landmarks       sorted by id; unknown ids are passed over
/// @param T_world_camera  in the landmarks' world
GuidedSearch search_landmarks(const Map& map, std::span<const LandmarkId> landmarks,
                              const ImageView& image, const Pose& T_world_camera,
                              const GuidedSearchOptions& options);

/// How well an image shows what it should.
struct MatchConsistency {
  double found = 0;  ///< share of what should be seen that is
  /// Share of what should be seen that lies where next to nothing is found. In a place seen again,
  /// what is missed lies scattered; in one that only looks alike, or is alike in part, whole parts
  /// of the picture are missed.
  double blank = 0;
};
MatchConsistency consistency(const Camera& camera, std::span<const ExpectedLandmark> expected);

/// The pose that matches agree on, and which of them agree: solve_pose() on them.
struct MatchedPose {
  PoseSolution solution;
  std::vector<LandmarkMatch> inliers;
  int contradicted = 0;  ///< inliers by pixel whose depth is another
};
MatchedPose solve_matches(const Map& map, std::span<const LandmarkMatch> matches,
                          const ImageView& image, const Pose& T_world_camera_guess,
                          const PoseSolverOptions& options);

}  // namespace stillmap
