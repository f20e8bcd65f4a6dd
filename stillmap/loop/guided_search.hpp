// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <cstdint>
#include <span>
#include <string>
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

/// Agreement of the texture of surfaces between landmarks and images.
struct TextureAgreement {
  int regions = 0;  ///< Number of image regions in which at least five landmarks are seen.
  /// Sum over these: share of nearly equal descriptors among the similar ones; 0 without any.
  double alike = 0;
  TextureAgreement& operator+=(const TextureAgreement& other);
  /// Returns whether map and images can be of one place; true if too few regions show surfaces.
  bool of_one_place() const;
  /// Returns whether the sum over a run says that the camera is at another place than the map, of
  /// which some images pass the test above; false if too few regions show surfaces.
  bool of_another_place() const;
  /// Returns why they are not, for the log.
  std::string text() const;
};
/// Compares landmarks with the keypoints at their projections whose depth agrees. Rooms of equal
/// furniture have corners at the same positions, with descriptors similar enough for matches; those
/// of one place are closer.
/// @param landmarks       sorted by id; unknown ids are ignored
/// @param T_world_camera  estimated pose in the landmarks' world frame
/// @param radius          around each projection [pixels at level 0]
TextureAgreement texture_agreement(const Map& map, std::span<const LandmarkId> landmarks,
                                   const ImageView& image, const Pose& T_world_camera,
                                   double radius);

/// Pose estimated from matches by solve_pose(), with its inliers.
struct MatchedPose {
  PoseSolution solution;
  std::vector<LandmarkMatch> inliers;
  int contradicted = 0;  ///< Number of inliers by pixel whose measured depth disagrees.
};
MatchedPose solve_matches(const Map& map, std::span<const LandmarkMatch> matches,
                          const ImageView& image, const Pose& T_world_camera_guess);

}  // namespace stillmap
