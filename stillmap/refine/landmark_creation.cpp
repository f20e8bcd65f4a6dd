// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/landmark_creation.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

namespace stillmap {
namespace {

/// Maximum number of covisible keyframes used for triangulation, and minimum number of landmarks
/// that they share with the newest one.
constexpr int kTriangulationNeighbors = 5, kMinShared = 15;
/// Minimum angle between the two rays [degrees].
constexpr double kMinParallax = 1.0;
/// Maximum Hamming distance of a match across keyframes [bits].
constexpr int kMaxDistance = 50;
/// Ratio test between the nearest and the second nearest descriptor (Lowe 2004).
constexpr double kRatio = 0.8;
/// Maximum reprojection error in each view [pixels at level 0].
constexpr double kMaxError = 2.0;

constexpr double kDegree = std::numbers::pi / 180;

struct Ray {
  Eigen::Vector3d origin, direction;  // In the world frame; the direction has unit length.
};

Ray ray_of(const Map& map, const Keyframe& keyframe, std::uint32_t keypoint) {
  const Keypoint& k = keyframe.features->keypoints[keypoint];
  const Eigen::Vector3d d = map.camera().unproject(k.u, k.v, 1);
  return {keyframe.T_world_camera.translation(),
          (keyframe.T_world_camera.quaternion() * d).normalized()};
}

/// Returns the midpoint of the closest points of two rays; nothing if they are nearly parallel.
std::optional<Eigen::Vector3d> midpoint(const Ray& a, const Ray& b) {
  const double c = a.direction.dot(b.direction);
  if (c > std::cos(kMinParallax * kDegree)) return std::nullopt;
  const Eigen::Vector3d w = b.origin - a.origin;
  const double s = 1 - c * c;
  const double along_a = (w.dot(a.direction) - c * w.dot(b.direction)) / s;
  const double along_b = (c * w.dot(a.direction) - w.dot(b.direction)) / s;
  if (along_a <= 0 || along_b <= 0) return std::nullopt;
  return 0.5 * (a.origin + along_a * a.direction + b.origin + along_b * b.direction);
}

/// Returns whether the point lies in front of the camera and projects near the keypoint.
bool reprojects(const Map& map, const Keyframe& keyframe, std::uint32_t keypoint,
                const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p = keyframe.T_world_camera.inverse() * p_world;
  if (p.z() < 0.05) return false;
  const Keypoint& k = keyframe.features->keypoints[keypoint];
  const double error = (map.camera().project(p) - Eigen::Vector2d(k.u, k.v)).norm();
  return error < kMaxError * map.pyramid().scale(k.level);
}

/// Returns the keypoints without a landmark and without a usable depth.
std::vector<std::uint32_t> unplaced(const Keyframe& keyframe, float max_depth) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < keyframe.features->size(); ++i) {
    const float depth = keyframe.features->keypoints[i].depth;
    const bool has_depth = depth > 0 && depth <= max_depth;
    if (!keyframe.landmarks[i].valid() && keyframe.static_weight[i] > 0 && !has_depth)
      result.push_back(i);
  }
  return result;
}

std::vector<Descriptor> pick(const Features& features, const std::vector<std::uint32_t>& indices) {
  std::vector<Descriptor> picked;
  picked.reserve(indices.size());
  for (const auto i : indices) picked.push_back(features.descriptors[i]);
  return picked;
}

int triangulate_with(Map& map, const Keyframe& a, const Keyframe& b, float max_depth) {
  const auto from_a = unplaced(a, max_depth), from_b = unplaced(b, max_depth);
  BruteForceMatchOptions matching;
  matching.max_distance = kMaxDistance;
  matching.ratio = kRatio;
  int created = 0;
  for (const auto& pair :
       match_brute_force(pick(*a.features, from_a), pick(*b.features, from_b), matching)) {
    const std::uint32_t ia = from_a[pair.a];
    const std::uint32_t ib = from_b[pair.b];
    const auto p_world = midpoint(ray_of(map, a, ia), ray_of(map, b, ib));
    if (!p_world || !reprojects(map, a, ia, *p_world) || !reprojects(map, b, ib, *p_world)) {
      continue;
    }
    const LandmarkId id = map.add_landmark(*p_world, {a.id, ia}).id;
    if (map.observe(id, {b.id, ib})) map.refresh(id);
    ++created;
  }
  return created;
}

/// Returns the depth up to which landmarks are created from depth [m]: the depth with standard
/// deviation `max_sigma`, or the largest of the `fewest` nearest keypoints if that is larger.
float depth_limit(const Keyframe& keyframe, const DepthSensor& sensor, double max_sigma,
                  std::size_t fewest) {
  const float near = sensor.depth_at_sigma(max_sigma);
  if (fewest == 0) return near;
  std::vector<float> depths;
  for (std::size_t i = 0; i < keyframe.features->size(); ++i) {
    const float depth = keyframe.features->keypoints[i].depth;
    if (depth > 0 && keyframe.static_weight[i] > 0) depths.push_back(depth);
  }
  std::sort(depths.begin(), depths.end());
  if (depths.empty()) return near;
  return std::max(near, depths[std::min(fewest, depths.size()) - 1]);
}

}  // namespace

int create_from_depth(Map& map, KeyframeId id, double max_sigma, std::size_t fewest) {
  const TraceScope scope("landmarks from depth");
  const Keyframe& keyframe = map.at(id);
  const float farthest = depth_limit(keyframe, map.camera().depth_sensor, max_sigma, fewest);
  int created = 0;
  for (std::uint32_t i = 0; i < keyframe.features->size(); ++i) {
    const Keypoint& k = keyframe.features->keypoints[i];
    if (keyframe.landmarks[i].valid() || keyframe.static_weight[i] <= 0) continue;
    if (k.depth <= 0 || k.depth > farthest) continue;
    map.add_landmark(keyframe.T_world_camera * map.camera().unproject(k.u, k.v, k.depth), {id, i});
    ++created;
  }
  return created;
}

int create_by_triangulation(Map& map, KeyframeId id, double max_sigma) {
  const TraceScope scope("triangulation");
  const float max_depth = map.camera().depth_sensor.depth_at_sigma(max_sigma);
  int created = 0, tried = 0;
  for (const Covisible& neighbor : map.covisible(id, kMinShared)) {
    if (tried++ >= kTriangulationNeighbors) break;
    created += triangulate_with(map, map.at(id), map.at(neighbor.keyframe), max_depth);
  }
  return created;
}

}  // namespace stillmap
