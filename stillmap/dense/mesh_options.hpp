// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

struct MeshOptions {
  double voxel = 0.01;       ///< Side of the voxels, the smallest detail of the mesh [m].
  double truncation = 0.04;  ///< Largest distance from a surface in the volume [m].
};

}  // namespace stillmap
