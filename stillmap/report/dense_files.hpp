// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/floor.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/report/captioned_image.hpp"
#include "stillmap/report/result_folder.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Which files are made from the dense map in addition to its cloud.
struct DenseOutputs {
  std::vector<std::string> mesh;  ///< File formats of the mesh: ply, obj, glb; empty: no mesh.
  bool planner = false;           ///< Whether to write the files of write_planner_files().
  FloorHints floor;               ///< For the planner's files.
};

/// Throws Error for a mesh format that does not exist.
void check(const DenseOutputs& outputs);
/// Returns the names of the files of a mesh in some formats; none without one.
std::vector<std::string> mesh_file_names(const std::vector<std::string>& formats);

/// A dense map with the data of the run that its files also show.
struct DenseResults {
  const ComposedCloud& cloud;    ///< Static cloud with object labels, world frame.
  const PlacedMap& placed;       ///< Views of which the cloud was made.
  const Trajectory& trajectory;  ///< T_world_camera; defines up and the view of the images.
  const std::vector<MoverTrack>& movers;  ///< Movers in the world frame, for the obstacles.
};

/// The images for the report, and the problem with the floor.
struct DenseFiles {
  std::vector<CaptionedImage> images;  ///< Images of cloud, classes, mesh and grid, in this order.
  std::string floor_problem;           ///< See PlannerFiles.
};

/// Writes cloud.ply and cloud.png; semantic*.ply/.png and objects.json if a network found objects;
/// mesh.* and the planner's files if wanted.
DenseFiles write_dense_files(const DenseResults& results, const DenseOptions& options,
                             const DenseOutputs& outputs, ResultFolder& folder);

}  // namespace stillmap
