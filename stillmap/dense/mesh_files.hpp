// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/mesh.hpp"
#include "stillmap/dense/texture.hpp"

#include <string>
#include <string_view>

#include <Eigen/Core>

namespace stillmap {

// Contents of files. The same mesh gives the same bytes. Written by hand: tinygltf and Assimp would
// be large dependencies for one file header.

/// Returns a .ply file (binary little endian) with the colors of the vertices.
std::string mesh_ply(const TriangleMesh& mesh);

/// Returns a .glb file (binary glTF 2.0) with the texture as a JPEG image, which programs show as
/// it is, without lights.
/// @param up upward direction; programs show the mesh upright along it
std::string mesh_glb(const TexturedMesh& mesh, const Eigen::Vector3d& up);

/// Returns a .obj file, and the .mtl file of its material.
/// @param material name of the .mtl file
/// @param image    name of the texture's file
std::string mesh_obj(const TexturedMesh& mesh, std::string_view material);
std::string mesh_mtl(std::string_view image);

}  // namespace stillmap
