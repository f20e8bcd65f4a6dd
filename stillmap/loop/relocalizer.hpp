// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/loop/guided_search.hpp"
#include "stillmap/loop/node_matching.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/loop/pose_ransac.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct RelocalizerOptions {
  PlaceQueryOptions query{.island_share = 0.4, .max_candidates = 5};
  NodeMatchOptions matching;
  PoseRansacOptions ransac{.ransac = {.min_inliers = 12}};
  GuidedSearchOptions wide{.radius = 10};   ///< around the pose that RANSAC found
  GuidedSearchOptions narrow{.radius = 4};  ///< around the refined one
  PoseSolverOptions solver;
  int window = 10;       ///< best covisible keyframes of a candidate whose landmarks take part
  int min_matches = 15;  ///< by node, with a landmark
  int min_inliers = 40;  ///< landmarks that agree with the pose
  /// Of the landmarks of the candidate that should be seen, those that are; and at most so many
  /// where nothing is: see MatchConsistency. Looser than for a loop, since people may cover much.
  double min_found_share = 0.2;
  double max_blank_share = 0.4;
  /// Of the landmarks that agree by pixel and have a depth, at most so many whose depth is another.
  double max_contradicted = 0.4;
  STILLMAP_FIELDS(query, matching, ransac, wide, narrow, solver, window, min_matches, min_inliers,
                  min_found_share, max_blank_share, max_contradicted)
};

/// Where a lost camera is.
struct Relocalization {
  Pose T_world_camera;      ///< in the map's world, as it was then
  KeyframeId reference;     ///< keyframe that the place was recognized by
  Pose T_reference_camera;  ///< holds while the map moves
  std::uint32_t component = 0;
  std::vector<LandmarkId> landmarks;  ///< per keypoint: what it shows; invalid where not known
  int inliers = 0;                    ///< keypoints that show a landmark
  double found_share = 0, blank_share = 0;  ///< see MatchConsistency
};

/// A place, or in `reason` why there is none, for the log.
struct RelocalizationVerification {
  std::optional<Relocalization> result;
  std::string reason;  ///< empty if there is a result
};

/// Finds a camera in the map without any guess. The candidates of place recognition, best first:
/// matches by node with the keyframe's landmarks; a pose by RANSAC, from 3-D/3-D pairs where enough
/// keypoints have a depth, else from three pixels at a time (P3P), and from those too where the
/// depths lead to nothing; refined with the landmarks around, looked for by projection. A place
/// that looks alike only in part is refused.
///
/// Made for the thread that owns the map and the index, between two keyframes: it reads both and
/// changes nothing. A tracker in another thread hands over its frame (an immutable message) and
/// gets this result, with the snapshot make_local_map(map, result.reference) to go on in; what the
/// map does meanwhile does not matter, since T_reference_camera is relative to a keyframe.
/// @param component  if given, only its keyframes count
RelocalizationVerification relocalize(const Map& map, const PlaceIndex& index,
                                      const ImageView& image,
                                      const RelocalizerOptions& options = {},
                                      std::optional<std::uint32_t> component = std::nullopt);

}  // namespace stillmap
