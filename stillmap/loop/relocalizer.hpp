// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/guided_search.hpp"
#include "stillmap/loop/node_matching.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/optimize/pose_ransac.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Result of a relocalization.
struct Relocalization {
  Pose T_world_camera;   ///< In the map's world frame at that time.
  KeyframeId reference;  ///< Keyframe by which the place was recognized.
  /// Pose relative to `reference`; stays valid when the map is corrected.
  Pose T_reference_camera;
  std::uint32_t component = 0;
  /// One per keypoint: the landmark that it shows, or an invalid id.
  std::vector<LandmarkId> landmarks;
  int inliers = 0;                          ///< Number of keypoints that show a landmark.
  double found_share = 0, blank_share = 0;  ///< See MatchConsistency [0..1].
};

/// A result, or the reason for the failure.
struct RelocalizationVerification {
  std::optional<Relocalization> result;
  std::string reason;  ///< Of the most similar place; empty if there is a result.
};

/// Finds the pose of a camera in the map without an initial guess. Tries the candidates of place
/// recognition, best first: matches by vocabulary node with the keyframe's landmarks; a pose by
/// RANSAC, from 3D-3D pairs if enough keypoints have a depth, otherwise or if that fails from three
/// pixels at a time (P3P); then refinement with surrounding landmarks matched by projection. A
/// place that is similar only in part, or of other texture, is rejected.
///
/// Runs in the thread that owns the map and the index, and changes neither. The tracker passes its
/// frame (an immutable message) and receives this result with the snapshot make_local_map(map,
/// result.reference); the map may change in between, since T_reference_camera is relative to a
/// keyframe.
RelocalizationVerification relocalize(const Map& map, const PlaceIndex& index,
                                      const ImageView& image);

}  // namespace stillmap
