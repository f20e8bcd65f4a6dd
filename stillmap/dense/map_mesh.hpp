// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/mesh.hpp"
#include "stillmap/dense/texture.hpp"
#include "stillmap/dense/tsdf_volume.hpp"

namespace stillmap {

/// Returns 255 for each pixel of a view whose voxel is in the static map.
cv::Mat1b static_pixels(const PosedView& placed, const StaticGrid& grid);

/// Returns the mesh of a placed map from the surfaces of its views that the grid holds as static,
/// far surfaces included, where it has points, with the colors of the views.
TriangleMesh make_mesh(const PlacedMap& placed, const MeshOptions& options = {});

/// Returns a mesh of make_mesh() for looking at: fewer triangles, and a texture of the photos of
/// the views.
TexturedMesh make_textured_mesh(const TriangleMesh& mesh, const PlacedMap& placed,
                                const MeshOptions& options = {});

}  // namespace stillmap
