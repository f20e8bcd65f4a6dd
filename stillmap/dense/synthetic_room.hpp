// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/floor.hpp"
#include "stillmap/dense/floor_plan.hpp"
#include "stillmap/dense/obstacles.hpp"
#include "stillmap/dense/occupancy.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>

namespace stillmap::testing_support {

/// A room in the world frame (x right, y down, origin at the camera) with a floor 1.2 m below the
/// camera, a wall 3 m ahead, and a box of 40 cm on the floor with its front 2 m ahead.
inline constexpr double kFloorY = 1.2, kWallZ = 3, kBoxFront = 2, kBoxTop = 0.8;
inline const Pose kRoomCamera(so3_exp({-0.35, 0, 0}), {0, 0, 0});  // pitched down by 20 degrees

inline double room_depth(int u, int v) {
  const Eigen::Vector3d ray = kRoomCamera.quaternion() * small_camera().unproject(u, v, 1);
  double s = kWallZ / ray.z();
  if (ray.y() > 0) s = std::min(s, kFloorY / ray.y());
  const Eigen::Vector3d front = ray * (kBoxFront / ray.z());
  if (std::abs(front.x()) < 0.2 && front.y() > kBoxTop && front.y() < kFloorY) {
    s = std::min(s, kBoxFront / ray.z());
  }
  const Eigen::Vector3d top = ray * (kBoxTop / ray.y());
  if (ray.y() > 0 && std::abs(top.x()) < 0.2 && top.z() > kBoxFront && top.z() < kBoxFront + 0.4) {
    s = std::min(s, kBoxTop / ray.y());
  }
  return s;  // The ray has z = 1 in the camera frame, so this is the depth.
}

/// The maps for planners from one view of the room.
struct PlannerMaps {
  ComposedCloud cloud;
  Floor floor;
  Pose T_map_world;
  OccupiedSpace space;
  OccupancyGrid grid;
  std::vector<StaticObstacle> obstacles;
};

inline PlannerMaps planner_maps() {
  DenseOptions options;
  options.back_projection.stride = 1;
  DenseMap map(small_camera(), options);
  map.add(0, frame_of(small_camera(), room_depth), {});
  const PlacedMap placed = map.place([](std::uint64_t) { return std::optional(kRoomCamera); });
  PlannerMaps result;
  result.cloud = cloud_of(placed);
  result.floor = {.up = {0, -1, 0}, .height = -kFloorY};
  result.T_map_world = map_frame(result.floor, kRoomCamera);
  result.space = occupied_space(placed, result.T_map_world);
  result.grid = floor_plan(result.space);
  result.obstacles = obstacles_in(result.space, 0);
  return result;
}

}  // namespace stillmap::testing_support
