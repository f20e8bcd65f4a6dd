// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/dense_map.hpp"

#include <cstddef>
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

/// Does the same for a cloud, of which only the points are known: normals are those of the planes
/// through the points of 3 x 3 x 3 cubes. Cubes at edges and corners of surfaces have no surfel. Of
/// large clouds evenly spread points are taken, see kMaxSurfelPoints.
/// @param eyes  positions of the cameras, world frame; a normal points to the nearest one
std::vector<Surfel> surfels_of(const Cloud& cloud, const std::vector<Eigen::Vector3d>& eyes,
                               double edge);

/// Greatest number of points of a cloud that its surfels are made of.
inline constexpr std::size_t kMaxSurfelPoints = 1'000'000;

}  // namespace stillmap
