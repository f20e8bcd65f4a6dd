// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/obstacles.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/mover_tracker.hpp"

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// The frame of the files for planners.
struct PlannerFrame {
  std::string name;  ///< "map" (z up from the floor), or "first camera" if the floor is unknown.
  Pose T_map_world;
};

/// Returns a pose as [tx, ty, tz, qx, qy, qz, qw].
nlohmann::json pose_json(const Pose& pose);

/// Returns the static obstacles: {"frame": name, "T_map_world": pose, "obstacles": [{"id",
/// "center", "size", "piece", "yaw"}]}, see StaticObstacle; meters and radians.
nlohmann::json obstacles_json(const std::vector<StaticObstacle>& obstacles,
                              const PlannerFrame& frame);

/// Returns the static obstacles and, for every frame, the moving ones: one JSON object per line.
/// The first is {"frame", "T_map_world", "static": [as in obstacles_json()]}, the others are
/// {"timestamp", "camera": [x, y, z], "movers": [{"id", "class", "centroid", "velocity", "box":
/// {"min", "max"}}]}; meters and m/s. The box of a mover is the bounding box of its rotated
/// box in the world.
/// @param movers  tracks in the trajectory's world; may be empty
std::string obstacles_by_frame(const std::vector<StaticObstacle>& obstacles,
                               const PlannerFrame& frame, const Trajectory& trajectory,
                               const std::vector<MoverTrack>& movers);

}  // namespace stillmap
