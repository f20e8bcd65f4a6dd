// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/landmark_fusion.hpp"

#include "stillmap/feature/matching.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

bool observed_by(const Landmark& landmark, KeyframeId keyframe) {
  return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                     [&](const Observation& o) { return o.keyframe == keyframe; });
}

/// Where the keyframe should see the landmark; none if it should not.
std::optional<ProjectionQuery> expected_view(const Map& map, const Keyframe& keyframe,
                                             const Pose& T_camera_world, const Landmark& landmark,
                                             const FusionOptions& options) {
  const Eigen::Vector3d p = T_camera_world * landmark.p_world;
  if (p.z() < 0.05) return std::nullopt;
  const Eigen::Vector2d uv = map.camera().project(p);
  if (!map.camera().contains(uv.x(), uv.y())) return std::nullopt;
  const Eigen::Vector3d ray = landmark.p_world - keyframe.T_world_camera.translation();
  const double range = ray.norm();
  if (range < landmark.min_distance || range > landmark.max_distance) return std::nullopt;
  if (ray.dot(landmark.normal) < options.min_view_cosine * range) return std::nullopt;
  const int level = expected_level(map.pyramid(), landmark.max_distance, range);
  return ProjectionQuery{.u = static_cast<float>(uv.x()),
                         .v = static_cast<float>(uv.y()),
                         .radius = static_cast<float>(options.radius * map.pyramid().scale(level)),
                         .min_level = level - 1,
                         .max_level = level + 1,
                         .descriptor = landmark.descriptor};
}

/// Whether the keypoint's depth, where it has one, is the landmark's.
bool depth_agrees(const Map& map, const Keypoint& keypoint, double depth,
                  const FusionOptions& options) {
  if (keypoint.depth <= 0) return true;
  const double bf = map.camera().bf();
  return std::abs(bf / keypoint.depth - bf / depth) < options.max_disparity;
}

/// Notes that keypoint i of the keyframe shows the landmark, merging if it already shows another
/// one.
int join(Map& map, const Keyframe& keyframe, std::uint32_t i, LandmarkId id) {
  const LandmarkId shown = keyframe.landmarks[i];
  if (!shown.valid()) {
    if (keyframe.static_weight[i] <= 0 || !map.observe(id, {keyframe.id, i})) return 0;
    map.refresh(id);
    return 1;
  }
  if (shown == id) return 0;
  const bool keep_shown = map.at(shown).observations.size() >= map.at(id).observations.size();
  map.merge(keep_shown ? shown : id, keep_shown ? id : shown);
  return 1;
}

int fuse_into(Map& map, KeyframeId target, const std::vector<LandmarkId>& landmarks,
              const FusionOptions& options) {
  const Keyframe& keyframe = map.at(target);
  const Pose T_camera_world = keyframe.T_world_camera.inverse();
  std::vector<ProjectionQuery> queries;
  std::vector<LandmarkId> ids;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr || observed_by(*landmark, target)) continue;
    if (const auto query = expected_view(map, keyframe, T_camera_world, *landmark, options)) {
      queries.push_back(*query);
      ids.push_back(id);
    }
  }
  ProjectionMatchOptions matching;
  matching.max_distance = options.max_distance;
  const auto found = match_by_projection(queries, *keyframe.features, matching);
  int joined = 0;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const Landmark* landmark = map.find(ids[q]);  // may have been merged away meanwhile
    if (!found[q] || landmark == nullptr) continue;
    const double depth = (T_camera_world * landmark->p_world).z();
    if (!depth_agrees(map, keyframe.features->keypoints[*found[q]], depth, options)) continue;
    joined += join(map, keyframe, static_cast<std::uint32_t>(*found[q]), ids[q]);
  }
  return joined;
}

}  // namespace

int fuse_duplicates(Map& map, KeyframeId keyframe, const FusionOptions& options) {
  std::vector<KeyframeId> neighbours;
  for (const Covisible& c : map.covisible(keyframe, 15)) {
    if (neighbours.size() < static_cast<std::size_t>(options.neighbours))
      neighbours.push_back(c.keyframe);
  }
  int joined = 0;
  for (const KeyframeId neighbour : neighbours) {
    joined += fuse_into(map, neighbour, landmarks_seen_by(map, std::span(&keyframe, 1)), options);
  }
  return joined + fuse_into(map, keyframe, landmarks_seen_by(map, neighbours), options);
}

}  // namespace stillmap
