// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <span>

namespace stillmap {

/// Returns the covariance of a solved pose, of the perturbation (v, w) in T_world_camera exp(v, w)
/// [m^2, rad^2]: the inverse information times the variance of unit weight.
///
/// Errors of sensor and landmarks are alike for neighboring keypoints, which would make a
/// covariance from independent residuals too small. The variance of unit weight is therefore that
/// of the poses of delete-group jackknife (Busing, Meijer and Van der Leeden, Statistics and
/// Computing 1999): the image is divided into 4 x 4 parts, and the pose is estimated without each
/// of them. It is at least that of independent residuals.
/// @param observations  those of which the pose was solved
Matrix6d pose_covariance(const Camera& camera, std::span<const PoseObservation> observations,
                         const PoseSolution& solution);

}  // namespace stillmap
