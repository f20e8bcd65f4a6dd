// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// A triangle mesh with a color per vertex.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;                ///< World frame [m].
  std::vector<Rgb> colors;                              ///< One per vertex.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counterclockwise from outside.
  bool empty() const { return triangles.empty(); }
  bool operator==(const TriangleMesh&) const = default;
};

/// Returns the mesh without connected parts of fewer triangles and without unused vertices.
TriangleMesh without_specks(const TriangleMesh& mesh, std::size_t min_triangles);

/// Returns points on the mesh at most `spacing` [m] apart with interpolated colors, for images of
/// the mesh.
Cloud sampled(const TriangleMesh& mesh, double spacing);

}  // namespace stillmap
