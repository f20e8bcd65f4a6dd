// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

struct MeshOptions {
  double voxel = 0.02;       ///< side of the voxels: what is smaller is lost [m]
  double truncation = 0.08;  ///< distances from a surface are known up to this [m]
  double min_weight = 0.01;  ///< of a voxel in the mesh; a view from one meter weighs 1
  int min_triangles = 200;   ///< connected parts of fewer are left out
};

}  // namespace stillmap
