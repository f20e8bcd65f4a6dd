// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

struct MeshOptions {
  double voxel = 0.02;       ///< Side of the voxels, the smallest detail of the mesh [m].
  double truncation = 0.08;  ///< Largest distance from a surface in the volume [m].
};

}  // namespace stillmap
