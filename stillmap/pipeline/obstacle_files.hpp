// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/floor_plan.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// The static obstacles: {"T_map_world": [tx, ty, tz, qx, qy, qz, qw], "obstacles": [{"id", "box":
/// {"min", "max"}}]}; meters, frame `map` (z up from the floor).
nlohmann::json obstacles_json(const FloorPlan& plan, const Pose& T_map_world);

/// What a safety system asks for, one JSON object a line and second of the trajectory:
/// {"timestamp", "camera": [x, y, z], "static": [as above], "movers": [{"id", "class", "centroid",
/// "velocity", "box": {"min", "max"}}]}; meters and m/s, frame `map`. Movers are those of the first
/// frame in the second that has any, their boxes those around their boxes in the world, turned.
/// @param movers_jsonl text of movers.jsonl (see mover_files.hpp), in the trajectory's world; may
/// be empty. Throws Error where it is none
std::string obstacles_by_second(const FloorPlan& plan, const Pose& T_map_world,
                                const Trajectory& trajectory, const std::string& movers_jsonl);

}  // namespace stillmap
