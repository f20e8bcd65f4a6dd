// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <span>

#include <Eigen/Core>

namespace stillmap {

/// Returns the mean upward direction of cameras (unit vector, world frame): hand-held and mounted
/// cameras are upright on average. +z without cameras.
/// @param cameras T_world_camera
inline Eigen::Vector3d mean_up(std::span<const Pose> cameras) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose& T : cameras) sum -= T.rotation().col(1);  // image y points down
  return sum.norm() > 1e-6 ? Eigen::Vector3d(sum.normalized()) : Eigen::Vector3d::UnitZ();
}

}  // namespace stillmap
