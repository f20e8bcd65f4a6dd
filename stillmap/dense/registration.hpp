// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"

#include <vector>

namespace stillmap {

/// Registers the clouds of views by the iterative closest point algorithm with point-to-plane
/// distances (Chen and Medioni, Object modelling by registration of multiple range images, IVC
/// 1992), as the YOLO11n + Lucas-Kanade system does before it stitches them (Feng et al. 2026,
/// section 1.4, which names no variant).
///
/// Each view, in their order, is moved onto the surface of all views before it. That surface is a
/// grid of voxels of 5 cm, each with the mean and the normal of its points; a point belongs to the
/// plane of the voxel up to one side in front of or behind it. A view keeps its pose
/// if fewer than 50 of its points find a surface, or if it would move by more than 10 cm or 5
/// degrees. In directions that the surface does not determine, as along a wall, the pose stays as
/// it is. Deterministic.
std::vector<PosedView> registered(std::vector<PosedView> views);

}  // namespace stillmap
