// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/mesh.hpp"
#include "stillmap/dense/tsdf_volume.hpp"

namespace stillmap {

/// Returns the mesh of a placed map from the surfaces of its views that the grid holds as static,
/// with the grid's color gains.
TriangleMesh make_mesh(const PlacedMap& placed, const MeshOptions& options = {});

}  // namespace stillmap
