// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/floor_plan.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/mover_tracker.hpp"

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Returns the static obstacles: {"T_map_world": [tx, ty, tz, qx, qy, qz, qw], "obstacles": [{"id",
/// "box": {"min", "max"}}]}; meters, frame `map` (z up from the floor).
nlohmann::json obstacles_json(const FloorPlan& plan, const Pose& T_map_world);

/// Returns the static and moving obstacles over time, for a safety system: one JSON object per line
/// and second of the trajectory: {"timestamp", "camera": [x, y, z], "static": [as in
/// obstacles_json()], "movers": [{"id", "class", "centroid", "velocity", "box": {"min", "max"}}]};
/// meters and m/s, frame `map`. The movers are those of the first frame in the second that has any;
/// the box of a mover is the bounding box of its rotated box in the world.
/// @param movers  tracks in the trajectory's world; may be empty
std::string obstacles_by_second(const FloorPlan& plan, const Pose& T_map_world,
                                const Trajectory& trajectory,
                                const std::vector<MoverTrack>& movers);

}  // namespace stillmap
