// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace stillmap {

/// Features of an image that need not be a keyframe.
struct ImageView {
  const Features& features;
  /// One per keypoint; keypoints with weight 0 or less are excluded.
  std::span<const float> static_weight;
};

/// A match between keypoint `keypoint` and a landmark.
struct LandmarkMatch {
  std::uint32_t keypoint = 0;
  LandmarkId landmark;
  bool operator==(const LandmarkMatch&) const = default;
};

/// Expected image position of a landmark [pixels] and whether it was matched there.
struct ExpectedLandmark {
  float u = 0, v = 0;
  bool found = false;
};

/// Result of search_landmarks().
struct GuidedSearch {
  std::vector<LandmarkMatch> matches;  ///< Sorted by landmark; every keypoint appears at most once.
  /// Landmarks that should be visible: in the image, at a suitable distance and direction, and not
  /// occluded by the surfaces of nearby keypoints.
  std::vector<ExpectedLandmark> expected;
};

/// Returns a keyframe and its best covisible keyframes, at most `most` of these, which share at
/// least `min_shared` landmarks with it.
std::vector<KeyframeId> with_best_covisible(const Map& map, KeyframeId center, int most,
                                            int min_shared = 1);

/// Matches landmarks around their projections.
/// @param landmarks       sorted by id; unknown ids are ignored
/// @param T_world_camera  assumed pose in the landmarks' world frame
/// @param radius          search radius around each projection [pixels at level 0]
GuidedSearch search_landmarks(const Map& map, std::span<const LandmarkId> landmarks,
                              const ImageView& image, const Pose& T_world_camera, double radius);

/// Agreement between the expected and the matched landmarks of an image.
struct MatchConsistency {
  double found = 0;  ///< Share of the expected landmarks that were matched [0..1].
  /// Share of the expected landmarks in image regions where almost none is matched [0..1]. At the
  /// right place misses are scattered; at a place that only looks similar, whole regions are
  /// missed.
  double blank = 0;
};
MatchConsistency consistency(const Camera& camera, std::span<const ExpectedLandmark> expected);

/// Pose estimated from matches by solve_pose(), with its inliers.
struct MatchedPose {
  PoseSolution solution;
  std::vector<LandmarkMatch> inliers;
  int contradicted = 0;  ///< Number of inliers by pixel whose measured depth disagrees.
};
MatchedPose solve_matches(const Map& map, std::span<const LandmarkMatch> matches,
                          const ImageView& image, const Pose& T_world_camera_guess);

}  // namespace stillmap
