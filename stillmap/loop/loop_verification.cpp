// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/loop_verification.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/loop/essential_graph.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Search radius around the pose found by RANSAC, and around the refined pose [pixels at level 0].
constexpr double kWideRadius = 10, kNarrowRadius = 4;
/// Number of the candidate's best covisible keyframes whose landmarks take part.
constexpr int kWindow = 10;
/// Minimum number of matches by node with a 3D position in both cameras.
constexpr int kMinMatches = 20;
/// Minimum number of inliers of the rigid motion found by RANSAC.
constexpr int kMinRansacInliers = 15;
/// Minimum number of landmarks of the candidate's side that the query keyframe observes.
constexpr int kMinInliers = 50;
/// Maximum number of neighbors of the query that are checked, and minimum number of landmarks that
/// each shares with it.
constexpr int kNeighbors = 5, kNeighborShared = 15;
/// Minimum number of matched landmarks for a neighbor to agree.
constexpr int kMinNeighborMatches = 25;

ImageView image_of(const Keyframe& keyframe) {
  return {*keyframe.features, keyframe.static_weight};
}

/// Returns the position of a keypoint in its keyframe's camera frame [m], from its landmark or else
/// from its depth.
std::optional<Eigen::Vector3d> position_of(const Map& map, const Keyframe& keyframe,
                                           std::uint32_t keypoint) {
  if (const Landmark* landmark = map.find(keyframe.landmarks[keypoint]))
    return keyframe.T_world_camera.inverse() * landmark->p_world;
  const Keypoint& k = keyframe.features->keypoints[keypoint];
  if (k.depth <= 0) return std::nullopt;
  return map.camera().unproject(k.u, k.v, k.depth);
}

/// Returns pairs with the candidate as a and the query as b.
std::vector<RigidPair> rigid_pairs(const Map& map, const PlaceIndex& index,
                                   const Keyframe& candidate, const Keyframe& query) {
  std::vector<RigidPair> pairs;
  const auto matches = match_by_node(*index.find(candidate.id), *candidate.features,
                                     *index.find(query.id), *query.features);
  for (const DescriptorMatch& m : matches) {
    const auto p_a = position_of(map, candidate, m.a), p_b = position_of(map, query, m.b);
    if (!p_a || !p_b) continue;
    const Keypoint& a = candidate.features->keypoints[m.a];
    const Keypoint& b = query.features->keypoints[m.b];
    pairs.push_back({*p_a,
                     *p_b,
                     {a.u, a.v},
                     {b.u, b.v},
                     map.pyramid().scale(a.level),
                     map.pyramid().scale(b.level)});
  }
  return pairs;
}

/// Returns the landmarks that a keyframe and its best covisible keyframes observe, without those
/// that `without` observes; sorted by id.
std::vector<LandmarkId> landmarks_around(const Map& map, KeyframeId center, int window,
                                         const Keyframe& without) {
  std::vector<LandmarkId> own(without.landmarks), result;
  std::sort(own.begin(), own.end());
  for (const LandmarkId id : landmarks_seen_by(map, with_best_covisible(map, center, window))) {
    if (!std::binary_search(own.begin(), own.end(), id)) result.push_back(id);
  }
  return result;
}

/// Returns the landmarks of a keyframe with more than one observation; landmarks observed once are
/// often wrong.
std::vector<LandmarkId> confirmed_landmarks(const Map& map, KeyframeId keyframe) {
  std::vector<LandmarkId> ids = landmarks_seen_by(map, std::span(&keyframe, 1));
  std::erase_if(ids, [&](LandmarkId id) { return map.at(id).observations.size() < 2; });
  return ids;
}

/// Returns how well a keyframe, at an estimated pose, shows the landmarks of another one.
MatchConsistency consistency_of(const Map& map, KeyframeId seen_by, const Keyframe& looked_for_in,
                                const Pose& T_world_camera, double radius) {
  const GuidedSearch search = search_landmarks(map, confirmed_landmarks(map, seen_by),
                                               image_of(looked_for_in), T_world_camera, radius);
  return consistency(map.camera(), search.expected);
}

/// One verification in steps; a failed step sets `reason_`.
class Verification {
 public:
  Verification(const Map& map, const PlaceIndex& index, KeyframeId query, KeyframeId candidate,
               const LoopVerificationOptions& options)
      : map_(map),
        index_(index),
        options_(options),
        query_(map.at(query)),
        candidate_(map.at(candidate)) {
    match_.query = query;
    match_.candidate = candidate;
    match_.same_component = query_.component == candidate_.component;
  }

  LoopVerification run() {
    int passed = 0;
    for (const auto test : {&Verification::estimate, &Verification::refine,
                            &Verification::surroundings_agree, &Verification::drift_is_possible,
                            &Verification::neighbors_agree, &Verification::texture_agrees}) {
      if (!(this->*test)()) return {std::nullopt, reason_, passed};
      ++passed;
    }
    return {match_, "", passed};
  }

 private:
  bool fail(std::string reason) {
    reason_ = std::move(reason);
    return false;
  }

  bool estimate() {
    const auto pairs = rigid_pairs(map_, index_, candidate_, query_);
    if (static_cast<int>(pairs.size()) < kMinMatches)
      return fail(fmt::format("{} matches, {} are needed", pairs.size(), kMinMatches));
    const auto consensus = find_rigid_motion(map_.camera(), pairs, kMinRansacInliers);
    if (!consensus) return fail(fmt::format("no rigid motion fits the {} matches", pairs.size()));
    T_world_query_ = candidate_.T_world_camera * consensus->model;
    return true;
  }

  bool refine() {
    landmarks_ = landmarks_around(map_, candidate_.id, kWindow, query_);
    for (const double radius : {kWideRadius, kNarrowRadius}) {
      const auto found =
          search_landmarks(map_, landmarks_, image_of(query_), T_world_query_, radius);
      const MatchedPose solved =
          solve_matches(map_, found.matches, image_of(query_), T_world_query_);
      if (!solved.solution.well_posed) return fail("the pose is not determined");
      T_world_query_ = solved.solution.T_world_camera;
      match_.matches = solved.inliers;
    }
    match_.inliers = static_cast<int>(match_.matches.size());
    match_.T_candidate_query = candidate_.T_world_camera.inverse() * T_world_query_;
    if (match_.inliers < kMinInliers)
      return fail(fmt::format("{} landmarks agree, {} are needed", match_.inliers, kMinInliers));
    return true;
  }

  bool surroundings_agree() {
    // The query's landmarks lie on its own side, so the candidate is moved to that side.
    const Pose T_world_candidate = query_.T_world_camera * match_.T_candidate_query.inverse();
    const MatchConsistency there =
        consistency_of(map_, candidate_.id, query_, T_world_query_, kNarrowRadius);
    const MatchConsistency here =
        consistency_of(map_, query_.id, candidate_, T_world_candidate, kNarrowRadius);
    match_.found_share = std::min(there.found, here.found);
    match_.blank_share = std::max(there.blank, here.blank);
    if (match_.found_share < options_.min_found_share ||
        match_.blank_share > options_.max_blank_share) {
      return fail(
          fmt::format("{:.0f} % of the expected landmarks matched, {:.0f} % in blank regions",
                      100 * match_.found_share, 100 * match_.blank_share));
    }
    return true;
  }

  bool drift_is_possible() {
    if (!match_.same_component) return true;
    std::string reason =
        why_no_drift(map_, query_.id, candidate_.id, T_world_query_, options_.drift);
    return reason.empty() || fail(std::move(reason));
  }

  TextureAgreement texture_in(const ImageView& image, const Pose& T_world_camera) const {
    return texture_agreement(map_, landmarks_, image, T_world_camera, kNarrowRadius);
  }

  /// Returns the pose of a neighbor by the candidate's landmarks; nothing if it does not agree.
  std::optional<Pose> confirmed_pose(const Keyframe& neighbor) const {
    const Pose T_world_neighbor =
        T_world_query_ * query_.T_world_camera.inverse() * neighbor.T_world_camera;
    const auto image = image_of(neighbor);
    const auto found = search_landmarks(map_, landmarks_, image, T_world_neighbor, kWideRadius);
    const MatchedPose solved = solve_matches(map_, found.matches, image, T_world_neighbor);
    // The neighbor's pose is independent, so it may differ by the tolerance of its landmarks.
    const Pose error = T_world_neighbor.inverse() * solved.solution.T_world_camera;
    constexpr double kMeters = 0.1, kRadians = 0.05;
    const bool agree = solved.solution.well_posed && error.translation().norm() < kMeters &&
                       error.angle() < kRadians &&
                       static_cast<int>(solved.inliers.size()) >= kMinNeighborMatches;
    return agree ? std::optional(solved.solution.T_world_camera) : std::nullopt;
  }

  bool neighbors_agree() {
    int asked = 0;
    for (const Covisible& c : map_.covisible(query_.id, kNeighborShared)) {
      if (asked == kNeighbors) break;
      ++asked;
      const Keyframe& neighbor = map_.at(c.keyframe);
      const auto pose = confirmed_pose(neighbor);
      if (!pose) continue;
      ++match_.neighbors_agree;
      texture_ += texture_in(image_of(neighbor), *pose);
    }
    // A new component has few keyframes; within one component a loop can wait for more.
    const bool young = !match_.same_component && asked < options_.min_neighbors_agree;
    const int needed = young ? std::max(asked, 1) : options_.min_neighbors_agree;
    if (match_.neighbors_agree < needed)
      return fail(fmt::format("{} neighbors agree, {} are needed", match_.neighbors_agree, needed));
    return true;
  }

  bool texture_agrees() {
    texture_ += texture_in(image_of(query_), T_world_query_);
    return texture_.of_one_place() || fail(texture_.text());
  }

  const Map& map_;
  const PlaceIndex& index_;
  const LoopVerificationOptions& options_;
  const Keyframe& query_;
  const Keyframe& candidate_;
  LoopMatch match_;
  Pose T_world_query_;                 // Pose of the query in the candidate's side of the map.
  std::vector<LandmarkId> landmarks_;  // Of the candidate's side; from refine() on.
  TextureAgreement texture_;           // Of the query and of the neighbors that agree.
  std::string reason_;
};

}  // namespace

LoopVerification verify_loop(const Map& map, const PlaceIndex& index, KeyframeId query,
                             KeyframeId candidate, const LoopVerificationOptions& options) {
  const TraceScope scope("verify");
  if (index.find(query) == nullptr || index.find(candidate) == nullptr)
    return {std::nullopt, "a keyframe is not in the index", 0};
  return Verification(map, index, query, candidate, options).run();
}

std::string why_no_drift(const Map& map, KeyframeId query, KeyframeId candidate,
                         const Pose& T_world_query, const DriftLimits& limits) {
  const double path = path_length(map, query, candidate);
  // Rotation drift moves the far end of the path, so the correction is measured at the query.
  const Pose& T_wrong = map.at(query).T_world_camera;
  const Pose correction = T_world_query * T_wrong.inverse();
  const double meters = (T_world_query.translation() - T_wrong.translation()).norm();
  if (meters <= limits.meters + limits.meters_per_meter * path &&
      correction.angle() <= limits.radians + limits.radians_per_meter * path)
    return {};
  return fmt::format(
      "a correction of {:.2f} m and {:.2f} rad exceeds the drift of a path of {:.1f} m", meters,
      correction.angle(), path);
}

double path_length(const Map& map, KeyframeId a, KeyframeId b) {
  return EssentialGraph(map, map.at(a).component).path_length(a, b);
}

}  // namespace stillmap
