// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Eigenvalues>

namespace stillmap {
namespace {

/// Number of points that the plane is searched in.
constexpr std::size_t kFloorSamples = 20000;
/// Largest distance of a point from its plane [m].
constexpr double kOnPlane = 0.03;
/// Minimum number of points on the floor relative to the fullest level plane [0..1].
constexpr double kFloorShare = 0.15;
/// Cosine of the largest angle between the floor's normal and the upward direction.
const double kLargestTilt = std::cos(20 * std::numbers::pi / 180);

std::vector<Eigen::Vector3d> thinned(std::span<const Eigen::Vector3f> points) {
  std::vector<Eigen::Vector3d> some;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kFloorSamples);
  for (std::size_t i = 0; i < points.size(); i += step) some.push_back(points[i].cast<double>());
  return some;
}

std::size_t points_on(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                      double height) {
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](const auto& p) {
    return std::abs(up.dot(p) - height) < kOnPlane;
  }));
}

/// Returns the normal of the level plane with the most points, by RANSAC, or `up` if there is none.
Eigen::Vector3d level_normal(const std::vector<Eigen::Vector3d>& points,
                             const Eigen::Vector3d& up) {
  constexpr int kTries = 300;
  std::mt19937_64 random(1);
  Eigen::Vector3d best = up;
  std::size_t most = 0;
  for (int i = 0; i < kTries; ++i) {
    const auto& a = points[random() % points.size()];
    const auto& b = points[random() % points.size()];
    const auto& c = points[random() % points.size()];
    Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-4) continue;
    normal.normalize();
    if (normal.dot(up) < 0) normal = -normal;
    if (normal.dot(up) < kLargestTilt) continue;
    const std::size_t count = points_on(points, normal, normal.dot(a));
    if (count > most) most = count, best = normal;
  }
  return best;
}

/// Returns the lowest height [m] with at least kFloorShare of the points of the fullest one.
double lowest_level(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up) {
  std::map<int, std::size_t> histogram;  // over heights, bins of kOnPlane
  for (const auto& p : points) ++histogram[static_cast<int>(std::floor(up.dot(p) / kOnPlane))];
  std::size_t most = 0;
  for (const auto& [bin, count] : histogram) most = std::max(most, count);
  for (auto bin = histogram.begin(); bin != histogram.end(); ++bin) {
    if (static_cast<double>(bin->second) < kFloorShare * static_cast<double>(most)) continue;
    const auto next = std::next(bin);  // the plane may straddle two bins
    const bool higher =
        next != histogram.end() && next->first == bin->first + 1 && next->second > bin->second;
    return ((higher ? next : bin)->first + 0.5) * kOnPlane;
  }
  return 0;
}

/// Returns the least-squares plane through the points on the given one.
Floor refined(const std::vector<Eigen::Vector3d>& points, Floor floor) {
  for (int round = 0; round < 3; ++round) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> on;
    for (const auto& p : points) {
      if (std::abs(floor.up.dot(p) - floor.height) < kOnPlane) on.push_back(p);
    }
    if (on.size() < 10) break;
    for (const auto& p : on) mean += p;
    mean /= static_cast<double>(on.size());
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const auto& p : on) moments += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    Eigen::Vector3d normal = solver.eigenvectors().col(0);
    if (normal.dot(floor.up) < 0) normal = -normal;
    if (normal.dot(floor.up) < kLargestTilt) break;  // the points form a strip, not a plane
    floor.up = normal;
    floor.height = normal.dot(mean);
  }
  return floor;
}

}  // namespace

std::optional<Floor> find_floor(std::span<const Eigen::Vector3f> points,
                                const Eigen::Vector3d& up) {
  constexpr std::size_t kLeast = 100;
  const std::vector<Eigen::Vector3d> some = thinned(points);
  if (some.size() < kLeast || !(up.norm() > 0)) return std::nullopt;
  Floor floor;
  floor.up = level_normal(some, up.normalized());
  floor.height = lowest_level(some, floor.up);
  floor = refined(some, floor);
  for (const Eigen::Vector3f& p : points) {
    floor.points += std::abs(floor.up.dot(p.cast<double>()) - floor.height) < kOnPlane;
  }
  return floor.points >= kLeast ? std::optional(floor) : std::nullopt;
}

Pose map_frame(const Floor& floor, const Pose& T_world_camera) {
  const Eigen::Matrix3d R_camera = T_world_camera.rotation();
  const auto level = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v - floor.up.dot(v) * floor.up);
  };
  Eigen::Vector3d ahead = level(R_camera.col(2));
  if (ahead.norm() < 0.2) ahead = level(-R_camera.col(1));  // the camera looks straight down or up
  Eigen::Matrix3d R_map_world;
  R_map_world.row(0) = ahead.normalized();
  R_map_world.row(2) = floor.up;
  R_map_world.row(1) = floor.up.cross(ahead.normalized());
  const Eigen::Vector3d& eye = T_world_camera.translation();
  const Eigen::Vector3d below = eye - (floor.up.dot(eye) - floor.height) * floor.up;
  return {R_map_world, -(R_map_world * below)};
}

}  // namespace stillmap
