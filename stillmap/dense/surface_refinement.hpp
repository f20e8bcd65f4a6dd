// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"

#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Returns points of a surface, each moved to the mean of the points at which the views measure the
/// surface on its ray, weighted by 1 / sigma^2 of the depth there. A view counts if its four pixels
/// around the point show one surface that agrees with the point within its noise. The mean of a
/// voxel is of the measurements in the voxel alone, so that a noisy surface has several layers of
/// voxels; these meet here.
/// @param points  world frame [m]
std::vector<Eigen::Vector3f> refined_points(const std::vector<Eigen::Vector3f>& points,
                                            const std::vector<PosedView>& views);

}  // namespace stillmap
