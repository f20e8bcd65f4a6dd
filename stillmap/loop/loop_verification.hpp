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

/// Bounds on trajectory drift; a loop with a larger correction is rejected. RGB-D odometry drifts
/// by a few percent of the path length (Sturm et al., IROS 2012, table III); twice the worst value
/// is allowed.
struct DriftLimits {
  /// Constant part [m] and part per path length [m/m].
  double meters = 0.3, meters_per_meter = 0.06;
  /// Constant part [rad] and part per path length [rad/m].
  double radians = 0.15, radians_per_meter = 0.04;
};

struct LoopVerificationOptions {
  /// Minimum share of expected landmarks that are matched, in both directions [0..1]. Two identical
  /// desks match each other but not each other's surroundings. Chosen by measurement, see
  /// lab/records/loops.md.
  double min_found_share = 0.25;
  /// Maximum share of expected landmarks in blank regions: see MatchConsistency::blank [0..1].
  double max_blank_share = 0.3;
  /// Minimum number of neighbors that must confirm the matched pose; when merging with fewer
  /// neighbors: all of them, at least one.
  int min_neighbors_agree = 3;
  DriftLimits drift;
};

/// A verified loop or merge.
struct LoopMatch {
  KeyframeId query, candidate;
  /// Pose of the query keyframe from the candidate's side of the map: T_world_query' =
  /// T_world_candidate * T_candidate_query.
  Pose T_candidate_query;
  /// True if both belong to one component: a loop; otherwise a merge of two components.
  bool same_component = true;
  /// Landmarks of the candidate's side observed by the query keyframe, sorted by landmark; neither
  /// keypoints nor landmarks repeat. None if tags were matched: see verify_tags().
  std::vector<LandmarkMatch> matches;
  int inliers = 0;          ///< Number of inlier matches, or of corners of tags.
  double found_share = 0;   ///< Lower MatchConsistency::found of both directions [0..1].
  double blank_share = 0;   ///< Higher MatchConsistency::blank of both directions [0..1].
  int neighbors_agree = 0;  ///< Number of neighbors that confirm the match.
};

/// A match, or the reason for the rejection, for the log.
struct LoopVerification {
  std::optional<LoopMatch> match;
  std::string reason;  ///< Empty if there is a match.
  int passed = 0;      ///< Number of tests passed, of verify_loop()'s list.
};

/// Verifies a loop candidate: matches by vocabulary node; SE(3) from 3D-3D pairs by RANSAC (scale
/// is known); landmarks of either side matched in the other's keyframe; pose refinement; then the
/// tests: enough inliers, a sufficient share of expected landmarks matched in both directions,
/// a correction within the drift bounds, agreement of the query's neighbors, and equal texture
/// (TextureAgreement). Both keyframes must be in the map and in the index. Changes nothing.
/// Deterministic.
LoopVerification verify_loop(const Map& map, const PlaceIndex& index, KeyframeId query,
                             KeyframeId candidate, const LoopVerificationOptions& options = {});

/// Returns why a loop within a component would correct more than drift; empty if it would not.
/// @param T_world_query  pose of the query by the match
std::string why_no_drift(const Map& map, KeyframeId query, KeyframeId candidate,
                         const Pose& T_world_query, const DriftLimits& limits = {});

/// Returns the length of the shortest path between two keyframes of a component along the edges of
/// its essential graph [m]. Drift grows with it, and not with the way of a camera that visits
/// mapped places again.
double path_length(const Map& map, KeyframeId a, KeyframeId b);

}  // namespace stillmap
