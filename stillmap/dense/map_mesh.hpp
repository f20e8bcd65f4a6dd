// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/mesh.hpp"
#include "stillmap/dense/tsdf_volume.hpp"

namespace stillmap {

/// The mesh of a placed map: all its views integrated where the static grid holds that what they
/// saw is static, with the colors scaled as the grid's are.
TriangleMesh make_mesh(const PlacedMap& placed, const MeshOptions& options = {});

}  // namespace stillmap
