// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/previous_frame_tracking.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"

namespace stillmap {
namespace {

/// Search radius around a predicted keypoint of level 0 [pixels], as in ORB-SLAM2. It is doubled
/// if the first search fails.
constexpr double kSearchRadius = 15;
/// Search radius where the velocity of the camera is not known [pixels]: a turn of 180 degrees/s
/// at 30 Hz and a focal length of 525 pixels.
constexpr double kStartSearchRadius = 60;

/// Number of matches that agree with a pose near the prior, relative to that with another pose,
/// from which the former is right: three quarters where somebody who walks ahead fills half of the
/// view. Where the prior is wrong, few do.
constexpr double kLeastExpected = 0.3;

/// Bound of the squared pixel residual of a point that agrees roughly with a guess: 3 sigma
/// [sigma^2].
constexpr double kNearChi2 = 9;

/// Returns the world position [m] of a keypoint of the previous frame: that of its landmark, of its
/// odometry point, or its own depth's. Returns none for a keypoint without any of them.
std::optional<Eigen::Vector3d> point_of_previous(const TrackingModel& model,
                                                 const TrackerState& state, std::size_t keypoint,
                                                 const LocalLandmark* landmark) {
  if (landmark != nullptr) return landmark->p_world;
  if (keypoint < state.odometry_points.size() && state.odometry_points[keypoint])
    return state.odometry_points[keypoint];
  const Keypoint& k = state.previous->frame->features->keypoints[keypoint];
  if (k.depth <= 0) return std::nullopt;
  return state.T_world_previous * model.camera.unproject(k.u, k.v, k.depth);
}

/// @param excluded 1 for each keypoint that is not matched; empty for none
std::vector<FrameMatch> match_previous(const TrackingModel& model, const TrackerState& state,
                                       const Features& features,
                                       const std::vector<std::uint8_t>& excluded,
                                       const Pose& T_world_camera, double radius) {
  const TraceScope scope("match");
  const Frame& previous = *state.previous->frame;
  const Pose T_camera_world = T_world_camera.inverse();
  std::vector<FrameMatch> points;
  std::vector<ProjectionQuery> queries;
  for (std::size_t i = 0; i < previous.features->size(); ++i) {
    const Keypoint& k = previous.features->keypoints[i];
    const LandmarkId id = state.previous->landmarks[i];
    const LocalLandmark* landmark = id.valid() ? state.local_map->find(id) : nullptr;
    const auto p_world = point_of_previous(model, state, i, landmark);
    if (!p_world) continue;
    const Eigen::Vector3d p = T_camera_world * *p_world;
    if (p.z() < kNearPlane) continue;
    const Eigen::Vector2d uv = model.camera.project(p);
    if (!model.camera.contains(uv.x(), uv.y())) continue;
    queries.push_back({.u = static_cast<float>(uv.x()),
                       .v = static_cast<float>(uv.y()),
                       .radius = static_cast<float>(radius * model.pyramid.scale(k.level)),
                       .min_level = k.level - 1,
                       .max_level = k.level + 1,
                       .descriptor = previous.features->descriptors[i],
                       .angle = k.angle});
    points.push_back(
        {static_cast<std::uint32_t>(i),
         {0, landmark != nullptr ? id : LandmarkId{}, *p_world, previous.evidence.weight[i]}});
  }
  ProjectionMatchOptions matching;
  matching.max_distance = kMaxMatchDistance;
  matching.ratio = 1;  // no ratio test between consecutive frames
  const auto found = match_by_projection(queries, features, matching, excluded);
  std::vector<FrameMatch> matches;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (!found[q]) continue;
    points[q].match.keypoint = *found[q];
    matches.push_back(points[q]);
  }
  return matches;
}

/// Returns the matches whose pixels lie near their projections at a pose.
std::vector<PointMatch> matches_near(const TrackingModel& model, const Features& features,
                                     const Pose& T_world_camera,
                                     const std::vector<PointMatch>& matches) {
  std::vector<PointMatch> near;
  for (const PointMatch& match : matches) {
    if (chi2_of(model, features, T_world_camera, match).pixel <= kNearChi2) near.push_back(match);
  }
  return near;
}

/// Returns the pose from points that may move. Points of somebody near the camera pull the most,
/// and a robust kernel only limits their influence, so those that agree roughly with the guess are
/// preferred.
std::optional<PoseEstimate> estimate_from_points(const TrackingModel& model,
                                                 const Features& features, const Pose& guess,
                                                 const std::vector<PointMatch>& points,
                                                 const std::optional<PosePrior>& prior) {
  auto near = estimate_pose(model, features, guess, matches_near(model, features, guess, points),
                            kSureInliers, prior);
  return near ? near : estimate_pose(model, features, guess, points, kMinInliers, prior);
}

/// Landmarks have been static for a while, whereas a point of a single frame may move. So other
/// points are used only where landmarks are too few.
std::optional<PoseEstimate> estimate_from(const TrackingModel& model, const Features& features,
                                          const std::vector<FrameMatch>& matches, bool with_points,
                                          const Pose& guess,
                                          const std::optional<PosePrior>& prior) {
  std::vector<PointMatch> landmarks, all;
  for (const FrameMatch& m : matches) {
    if (m.match.weight <= 0) continue;
    all.push_back(m.match);
    if (m.match.landmark.valid()) landmarks.push_back(m.match);
  }
  if (!with_points) return estimate_pose(model, features, guess, landmarks, kMinInliers, prior);
  auto estimate = estimate_pose(model, features, guess, landmarks, kSureInliers, prior);
  return estimate && !estimate->contradicts_prior
             ? estimate
             : estimate_from_points(model, features, guess, all, prior);
}

/// Returns the pose after the first frame of a map, whose velocity is not known.
Pose pose_after_start(const TrackingModel& model, const TrackerState& state,
                      const Features& features, bool with_points,
                      const std::vector<std::uint8_t>& excluded) {
  const auto prior = state.prior();
  const Pose guess = prior ? prior->T_world_camera : state.T_world_previous;
  const auto matches = match_previous(model, state, features, excluded, guess, kStartSearchRadius);
  const auto estimate = estimate_from(model, features, matches, with_points, guess, prior);
  return estimate ? estimate->T_world_camera : guess;
}

/// Returns the pose by the prior, with the velocity of before where its translation is not known.
Pose expected_pose(const TrackerState& state) {
  const Pose T_previous_camera = state.motion_prior->T_previous_camera;
  if (!state.motion_prior->information.topRows<3>().isZero())
    return state.T_world_previous * T_previous_camera;
  return state.T_world_previous *
         Pose(T_previous_camera.quaternion(), state.T_previous_next.translation());
}

/// Returns the pose from matches near their places at a guess.
std::optional<PreviousFramePose> track_near(const TrackingModel& model, const TrackerState& state,
                                            const Features& features,
                                            const std::vector<std::uint8_t>& excluded,
                                            bool with_points, const Pose& guess) {
  const auto prior = state.prior();
  for (const double radius : {kSearchRadius, 2 * kSearchRadius}) {
    auto matches = match_previous(model, state, features, excluded, guess, radius);
    auto estimate = estimate_from(model, features, matches, with_points, guess, prior);
    if (estimate) return PreviousFramePose{std::move(*estimate), std::move(matches)};
  }
  return std::nullopt;
}

}  // namespace

std::optional<PreviousFramePose> track_previous_frame(const TrackingModel& model,
                                                      const TrackerState& state,
                                                      const Features& features,
                                                      const std::vector<float>& weights,
                                                      bool with_points) {
  std::vector<std::uint8_t> excluded;
  for (const float weight : weights) excluded.push_back(weight <= 0);
  const Pose guess = state.velocity_known()
                         ? state.T_world_previous * state.T_previous_next
                         : pose_after_start(model, state, features, with_points, excluded);
  const auto tracked_from = [&](const Pose& near) {
    return track_near(model, state, features, excluded, with_points, near);
  };
  auto tracked = tracked_from(guess);
  if (!state.motion_prior || (tracked && !tracked->estimate.contradicts_prior)) return tracked;
  auto expected = tracked_from(expected_pose(state));
  if (!expected || expected->estimate.contradicts_prior) return tracked;
  const bool enough = !tracked || std::ssize(expected->estimate.matches) >
                                      kLeastExpected * std::ssize(tracked->estimate.matches);
  return enough ? expected : tracked;
}

}  // namespace stillmap
