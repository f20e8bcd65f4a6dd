// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/ground.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/dense/surfels.hpp"
#include "stillmap/geometry/mean_up.hpp"

#include <cmath>
#include <numbers>
#include <vector>

namespace stillmap {
namespace {

constexpr double kBelowFloor = 0.02;  // share of a cloud's points below a floor that is not certain
constexpr std::size_t kGroundPoints = 20'000;  // number of points that such a floor is taken from
constexpr double kEyeHeight = 1.5;             // height of the camera above an unknown floor [m]
constexpr std::size_t kMaxCameras = 60;        // number of cameras that the floor is searched with
constexpr double kSameUp = std::numbers::pi / 180;  // see look_alike() [rad]
constexpr double kSameHeight = 0.05;                // see look_alike() [m]

/// Returns evenly spread poses of a trajectory, with the first one.
std::vector<Pose> some_poses(const Trajectory& trajectory) {
  std::vector<Pose> poses;
  const std::size_t step = 1 + trajectory.size() / kMaxCameras;
  for (std::size_t i = 0; i < trajectory.size(); i += step)
    poses.push_back(trajectory[i].T_world_camera);
  return poses;
}

/// Returns the height that kBelowFloor of the points are below [m].
double low_height(const Cloud& cloud, const Eigen::Vector3d& up, const Pose& first) {
  const std::size_t step = 1 + cloud.size() / kGroundPoints;
  std::vector<double> heights;
  for (std::size_t i = 0; i < cloud.size(); i += step)
    heights.push_back(up.dot(cloud.points[i].cast<double>()));
  return heights.empty() ? up.dot(first.translation()) - kEyeHeight
                         : quantile(heights, kBelowFloor);
}

std::vector<Surfel> surfels_seen_from(const std::vector<Pose>& cameras, const Cloud& cloud) {
  std::vector<Eigen::Vector3d> eyes;
  for (const Pose& camera : cameras) eyes.push_back(camera.translation());
  return surfels_of(cloud, eyes, kFloorSurfel);
}

/// Returns the floor that is searched with the hints; the one that they give needs no search.
FloorFinding searched_floor(const std::vector<Pose>& cameras, const Cloud& cloud,
                            const GroundHints& hints) {
  FloorHints given = hints.floor;
  if (hints.rules_up) {
    given.floor.reset();
    given.up = cameras.front().quaternion().conjugate() * *hints.rules_up;
  }
  return find_floor(given.floor ? std::vector<Surfel>() : surfels_seen_from(cameras, cloud),
                    cameras, given);
}

UpSource source_of(const GroundHints& hints, const FloorFinding& found) {
  if (hints.rules_up) return UpSource::kRules;
  if (hints.floor.up || hints.floor.floor) return UpSource::kRun;
  return found.floor ? UpSource::kFloor : UpSource::kImages;
}

}  // namespace

Ground displayed_ground(const Trajectory& trajectory, const Cloud& cloud,
                        const GroundHints& hints) {
  if (trajectory.empty()) return {};
  const std::vector<Pose> cameras = some_poses(trajectory);
  const FloorFinding found = searched_floor(cameras, cloud, hints);
  Ground ground{.source = source_of(hints, found)};
  if (found.floor) {
    ground.up = found.floor->up;
    ground.height = found.floor->height;
    return ground;
  }
  ground.up = found.up.value_or(mean_up(cameras));
  ground.height = low_height(cloud, ground.up, cameras.front());
  return ground;
}

bool look_alike(const Ground& a, const Ground& b) {
  return a.source == b.source && a.up.dot(b.up) > std::cos(kSameUp) &&
         std::abs(a.height - b.height) < kSameHeight;
}

}  // namespace stillmap
