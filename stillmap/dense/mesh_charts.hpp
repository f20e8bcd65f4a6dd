// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/mesh.hpp"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Connected triangles of a mesh that are nearly in one plane.
struct MeshChart {
  std::vector<std::uint32_t> triangles;  ///< Indices, ascending.
  Eigen::Matrix<float, 2, 3> axes;       ///< Orthonormal axes of the plane, as rows.
};

/// Returns the charts of a mesh, each triangle in one. The normals in a chart are within 60 degrees
/// of that of the plane, and no part of it is behind another one, so that its projection onto the
/// plane stretches triangles by a factor of at most two and does not fold.
/// @param side  largest extent in the plane [m]
std::vector<MeshChart> charts_of(const TriangleMesh& mesh, double side);

}  // namespace stillmap
