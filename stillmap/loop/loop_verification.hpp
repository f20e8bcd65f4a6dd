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

/// How far a trajectory may have drifted: a loop that wants more is none. RGB-D odometry drifts by
/// some per cent of the way (Sturm et al., IROS 2012, table III); twice the worst is allowed for.
struct DriftLimits {
  double meters = 0.3, meters_per_meter = 0.06;     ///< at once, and per meter traveled
  double radians = 0.15, radians_per_meter = 0.04;  ///< the same for the rotation
  STILLMAP_FIELDS(meters, meters_per_meter, radians, radians_per_meter)
};

struct LoopVerificationOptions {
  NodeMatchOptions matching;
  PoseRansacOptions rigid;
  GuidedSearchOptions wide{.radius = 10};   ///< around the pose that RANSAC found
  GuidedSearchOptions narrow{.radius = 4};  ///< around the refined one
  PoseSolverOptions solver;
  int window = 10;       ///< best covisible keyframes of the candidate whose landmarks take part
  int min_matches = 20;  ///< by node, with a place in either camera
  int min_inliers = 50;  ///< landmarks of the candidate's side that the query keyframe shows
  /// Of the candidate's landmarks that the query should show, and of the query's that the candidate
  /// should, those that it does. Two desks of one make show each other's things, but not each
  /// other's surroundings. Chosen by measurement, see docs/results.md.
  double min_found_share = 0.25;
  double max_blank_share = 0.3;  ///< of the same: see MatchConsistency::blank
  int neighbors = 5;             ///< keyframes beside the query that are asked, at most
  /// Of them, those that must show the candidate's side where the match says; where two maps are
  /// joined and there are fewer, all, but one at least.
  int min_neighbors_agree = 3;
  int min_neighbor_matches = 25;  ///< landmarks, for a neighbor to agree
  int neighbor_shared = 15;       ///< landmarks shared with the query that make a neighbor
  DriftLimits drift;
  STILLMAP_FIELDS(matching, rigid, wide, narrow, solver, window, min_matches, min_inliers,
                  min_found_share, max_blank_share, neighbors, min_neighbors_agree,
                  min_neighbor_matches, neighbor_shared, drift)
};

/// Two landmarks that are one thing.
struct LandmarkPair {
  LandmarkId query, candidate;
  bool operator==(const LandmarkPair&) const = default;
};

/// A place seen again, for certain.
struct LoopMatch {
  KeyframeId query, candidate;
  /// Where the query keyframe stands, as the candidate's side of the map sees it: T_world_query' =
  /// T_world_candidate * T_candidate_query.
  Pose T_candidate_query;
  /// Whether both are of one map already: then it is a loop, else a reason to merge two maps.
  bool same_component = true;
  /// What the query keyframe shows of the candidate's side: candidates for Map::observe() and
  /// merge(). Sorted by landmark; neither keypoints nor landmarks repeat.
  std::vector<LandmarkMatch> matches;
  /// Of these, where the query's keypoint shows a landmark of its own side.
  std::vector<LandmarkPair> pairs;
  int inliers = 0;                          ///< matches that agree
  double found_share = 0;                   ///< the lower of both sides'
  double blank_share = 0;                   ///< the higher of both sides'
  int neighbors_agree = 0;                  ///< further keyframes that confirm it
  Matrix6d information = Matrix6d::Zero();  ///< of the pose, see PoseSolution
};

/// A match, or in `reason` why there is none, for the log.
struct LoopVerification {
  std::optional<LoopMatch> match;
  std::string reason;  ///< empty if there is a match
};

/// Is the candidate the query's place? Matches by node; SE(3) from 3-D/3-D pairs (scale is known)
/// by RANSAC; landmarks of either side looked for in the other's keyframe; the pose solver; then
/// the tests that a wrong loop fails: enough inliers, enough of what should be seen is seen (both
/// ways), the query's neighbors see the same, and no more correction than a trajectory can drift.
/// Both keyframes must be in the map and in the index. Nothing is changed. Deterministic.
LoopVerification verify_loop(const Map& map, const PlaceIndex& index, KeyframeId query,
                             KeyframeId candidate, const LoopVerificationOptions& options = {});

/// Meters traveled by keyframes of one component from the older of two to the younger.
double path_length(const Map& map, KeyframeId a, KeyframeId b);

}  // namespace stillmap
