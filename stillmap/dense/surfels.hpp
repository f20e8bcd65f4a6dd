// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"

#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// A small piece of a static surface: the mean of the measurements in a cube.
struct Surfel {
  Eigen::Vector3d point;   ///< World frame [m].
  Eigen::Vector3d normal;  ///< Unit vector towards the cameras, world frame.
};

/// Returns the static surfaces of the views as one surfel for every cube with sides of `edge` [m],
/// ordered by cube, so that their number is a measure of area. Cubes with few measurements or with
/// contradicting normals have none.
std::vector<Surfel> surfels_of(const PlacedMap& placed, double edge);

}  // namespace stillmap
