// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/local_map_tracking.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/map/visibility.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace stillmap {
namespace {

/// Returns 1 for each keypoint that is left out because it moves, else 0.
std::vector<std::uint8_t> excluded(const Frame& frame) {
  std::vector<std::uint8_t> result(frame.features->size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = frame.evidence.weight[i] <= 0;
  return result;
}

/// Matches the landmarks that are not in `known`.
/// @param expected set to 1 for each landmark that should be in the image
std::vector<PointMatch> match_landmarks(const TrackingModel& model, const LocalMap& local_map,
                                        const Frame& frame, const Pose& T_world_camera,
                                        const std::vector<PointMatch>& known,
                                        std::vector<char>& expected) {
  const TraceScope scope("match");
  std::vector<std::uint8_t> taken = excluded(frame);
  for (const PointMatch& match : known) {
    taken[match.keypoint] = 1;
    expected[local_map.index(match.landmark)] = 1;
  }
  const LandmarkProjector view(model.camera, model.pyramid, T_world_camera);
  std::vector<ProjectionQuery> queries;
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < local_map.landmarks.size(); ++i) {
    if (expected[i]) continue;
    const auto query = view.expect(local_map.landmarks[i], kLandmarkSearchRadius, kMinViewCosine);
    if (!query) continue;
    expected[i] = 1;
    queries.push_back(*query);
    indices.push_back(i);
  }
  ProjectionMatchOptions matching;
  matching.max_distance = kMaxMatchDistance;
  matching.ratio = kMatchRatio;
  matching.check_rotation = false;  // landmarks have no angle
  const auto found = match_by_projection(queries, *frame.features, matching, taken);
  std::vector<PointMatch> matches;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (!found[q]) continue;
    const LocalLandmark& landmark = local_map.landmarks[indices[q]];
    matches.push_back({*found[q], landmark.id, landmark.p_world, 1});
  }
  return matches;
}

/// Returns the pose from landmarks and points of the previous frame, with the landmarks' matches.
std::optional<PoseEstimate> estimate_with_points(const TrackingModel& model, const Frame& frame,
                                                 const PoseEstimate& first,
                                                 std::vector<PointMatch> matches,
                                                 const std::optional<PosePrior>& prior) {
  for (PointMatch match : first.matches) {
    match.weight = frame.evidence.weight[match.keypoint];
    if (!match.landmark.valid() && match.weight > 0) matches.push_back(match);
  }
  auto estimate =
      estimate_pose(model, *frame.features, first.T_world_camera, matches, kSureInliers, prior);
  if (!estimate) return std::nullopt;
  std::erase_if(estimate->matches, [](const PointMatch& match) { return !match.landmark.valid(); });
  return std::ssize(estimate->matches) < kMinInliers ? std::nullopt : estimate;
}

}  // namespace

std::optional<LocalMapPose> refine_in_local_map(const TrackingModel& model,
                                                const LocalMap& local_map, const Frame& frame,
                                                const PoseEstimate& first, int min_landmarks,
                                                bool supported_by_points,
                                                const std::optional<PosePrior>& prior) {
  std::vector<PointMatch> matches;
  for (const PointMatch& match : first.matches) {
    if (match.landmark.valid() && frame.evidence.weight[match.keypoint] > 0)
      matches.push_back(match);
  }
  std::vector<char> expected(local_map.landmarks.size(), 0);
  const auto more =
      match_landmarks(model, local_map, frame, first.T_world_camera, matches, expected);
  matches.insert(matches.end(), more.begin(), more.end());
  for (PointMatch& match : matches) match.weight = frame.evidence.weight[match.keypoint];
  auto estimate =
      estimate_pose(model, *frame.features, first.T_world_camera, matches, min_landmarks, prior);
  if (!estimate && supported_by_points)
    estimate = estimate_with_points(model, frame, first, std::move(matches), prior);
  if (!estimate) return std::nullopt;
  return LocalMapPose{std::move(*estimate), std::move(expected)};
}

}  // namespace stillmap
