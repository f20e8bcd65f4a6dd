// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/floor.hpp"
#include "stillmap/dense/occupancy_options.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/report/captioned_image.hpp"
#include "stillmap/report/result_folder.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// The floor of a map, with the surfaces and cameras that it was searched in, world frame.
struct SearchedFloor {
  std::vector<Surfel> surfels;  ///< With sides of kFloorSurfel.
  std::vector<Pose> cameras;    ///< T_world_camera of the views.
  FloorFinding finding;
};

/// Searches the floor in all views of a map.
SearchedFloor search_floor(const PlacedMap& placed, const FloorHints& hints);

/// Data of the files for planners, all in the world frame.
struct PlannerData {
  const PlacedMap& placed;
  const SearchedFloor& floor;
  const Trajectory& trajectory;
  const std::vector<MoverTrack>& movers;
};

/// Result of write_planner_files() for the report.
struct PlannerFiles {
  /// A message about an unknown floor, or about hints that contradict the map, with the reason and
  /// the fix; empty if there is no problem.
  std::string problem;
  CaptionedImage grid;  ///< The grid, with its floor in the caption; empty without a grid.
};

/// Returns the names of all files that write_planner_files() may write.
std::vector<std::string> planner_file_names();

/// Writes the floor (floor.json), the occupied space (octomap.bt), and the obstacles
/// (obstacles.json, obstacles.jsonl), and, if the floor is known, the grid (grid.pgm, grid.yaml).
/// Those of an earlier call are removed first.
/// Without a floor the files are in the frame of the first camera and have no static obstacles.
PlannerFiles write_planner_files(const PlannerData& data, const OccupancyOptions& options,
                                 const FloorHints& hints, ResultFolder& folder);

/// Reads {"floor": {"up": [x, y, z], "height": m}} as write_planner_files() writes it, world frame.
/// Throws Error if the file has no such floor.
Floor read_floor(const std::filesystem::path& file);

}  // namespace stillmap
