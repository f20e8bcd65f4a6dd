// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
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

/// Writes a mesh by the file's extension: .ply (binary little endian), .obj (text, colors behind
/// the coordinates, as most programs read them) or .glb (binary glTF 2.0, COLOR_0). The same mesh
/// gives the same bytes. Complete or not at all. Written by hand: tinygltf and Assimp would be
/// large dependencies for one file header. Throws Error on another extension, and if the file
/// cannot be written.
/// @param up upward direction; programs show a .glb file upright along it
void write_mesh(const std::filesystem::path& file, const TriangleMesh& mesh,
                const Eigen::Vector3d& up = {0, -1, 0});

}  // namespace stillmap
