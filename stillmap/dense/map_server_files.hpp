// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/floor_plan.hpp"
#include "stillmap/geometry/pose.hpp"

#include <string>

namespace stillmap {

/// Returns the grid's image as binary PGM (P5), as map_server and Nav2 read it.
std::string grid_pgm(const OccupancyGrid& grid);

/// Returns the image of such a file; an empty one if it is damaged.
cv::Mat1b image_of_pgm(const std::string& pgm);

/// Returns the YAML file of the grid. Its last lines, comments, give T_map_world.
std::string grid_yaml(const OccupancyGrid& grid, const std::string& image_name,
                      const Pose& T_map_world);

}  // namespace stillmap
