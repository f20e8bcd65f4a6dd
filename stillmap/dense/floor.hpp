// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <cstddef>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace stillmap {

/// The plane of the floor.
struct Floor {
  Eigen::Vector3d up;      ///< Unit normal, world frame.
  double height = 0;       ///< Value of up . p for its points p [m].
  std::size_t points = 0;  ///< Number of points of the cloud on it.
};

/// Finds the floor: the lowest of the planes that are level, to within 20 degrees of `up`, and hold
/// a sufficient share of the points. Returns none if the cloud has no such plane.
/// @param points world frame [m]
/// @param up     approximate upward direction, such as the negative mean y axis of the cameras
std::optional<Floor> find_floor(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& up);

/// Returns T_map_world of frame `map`, in which planners get their maps: z up from the floor, the
/// camera above the origin, x along its horizontal viewing direction.
Pose map_frame(const Floor& floor, const Pose& T_world_camera);

}  // namespace stillmap
