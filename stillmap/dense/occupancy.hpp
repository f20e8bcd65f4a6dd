// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/occupancy_options.hpp"
#include "stillmap/dense/voxel_index.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace stillmap {

/// The floor.
struct Floor {
  Eigen::Vector3d up;      ///< unit normal, world frame
  double height = 0;       ///< up . p of its points [m]
  std::size_t points = 0;  ///< of the cloud that lie on it
};

/// Finds the floor: of the planes that lie level, to within 20 degrees of `up`, and hold a good
/// share of the points, the lowest. None in a cloud without one.
/// @param points world frame [m]
/// @param up     upwards as far as it is known: against the mean y axis of the cameras, say
std::optional<Floor> find_floor(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& up);

/// The frame that planners get their maps in: z up from the floor, x ahead of a camera, which
/// stands above the origin.
/// @param T_world_camera that camera
Pose map_frame(const Floor& floor, const Pose& T_world_camera);

/// Space in voxels: occupied, free, or, where neither, unknown.
struct OccupiedSpace {
  double edge = 0;              ///< side of a voxel [m]
  std::vector<Voxel> occupied;  ///< sorted; frame `map`
  std::vector<Voxel> free;      ///< sorted, none of them occupied
};

/// Occupied is where the cloud has points; free is what the views' rays went through up to what
/// they measured, on static surfaces and movers alike.
OccupiedSpace occupied_space(const PlacedMap& placed, const Pose& T_map_world,
                             const OccupancyOptions& options = {});

/// The space as an OctoMap file (.bt): Hornung, Wurm, Bennewitz, Stachniss, Burgard, OctoMap,
/// Autonomous Robots 2013. Equal neighbors are pruned. Written here, as the format is small and
/// liboctomap would be one more thing to install.
/// Throws Error if the space is wider than the 2^15 voxels on each side of the origin that it has.
std::string octomap_bytes(const OccupiedSpace& space);

/// A map for a robot on the floor, as map servers read it: PGM image and YAML file.
struct OccupancyGrid {
  double resolution = 0;                             ///< side of a cell [m]
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< lower left corner in frame `map` [m]
  cv::Mat1b image;  ///< upper row: highest y; 0 occupied, 254 free, 205 unknown
};

/// An obstacle of the static world: connected occupied cells of the grid.
struct StaticObstacle {
  int id = 0;               ///< 1, 2, 3 ... by falling area
  Eigen::AlignedBox3d box;  ///< frame `map` [m]
};

struct FloorPlan {
  OccupancyGrid grid;
  std::vector<StaticObstacle> obstacles;
};

/// The space between `lowest` and `highest` above the floor, seen from above. A cell is occupied if
/// any of its voxels in the band is, free if it is not and one of them was seen to be, or the floor
/// beneath was.
FloorPlan floor_plan(const OccupiedSpace& space, const OccupancyOptions& options = {});

/// The image as PGM (binary, P5), and the YAML beside it, as map_server and Nav2 read them.
std::string grid_pgm(const OccupancyGrid& grid);
/// The YAML's last lines, a comment to them, say where frame `map` lies in the trajectory's world.
std::string grid_yaml(const OccupancyGrid& grid, const std::string& image_name,
                      const Pose& T_map_world);

}  // namespace stillmap
