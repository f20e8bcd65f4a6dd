// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/occupancy.hpp"

#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// An obstacle of the static world, or a part of one: a box that stands upright.
struct StaticObstacle {
  int id = 0;                                        ///< 1, 2, 3 ... by decreasing volume.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< Frame `map` [m].
  Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< Along the sides of the box [m].
  /// 1, 2, 3 ...: boxes of one piece of furniture, or of one wall, have the same number.
  int piece = 0;
  double yaw = 0;  ///< Rotation of the box about the z axis of frame `map` [rad].

  /// Returns whether a point of frame `map` is in the box.
  bool contains(const Eigen::Vector3d& p_map) const;
};

/// Divides the occupied space between two heights into boxes, each of which covers occupied voxels
/// and unknown voxels, but no free voxel. A box is a part of a wall or of a piece of furniture.
/// Boxes may overlap; those that touch are one piece, but a wall and what stands at it are two, and
/// so are two walls that meet. Boxes that are smaller than 15 cm in all directions are left out.
/// @param space of a frame that is rotated by `yaw` about the z axis of frame `map`
std::vector<StaticObstacle> obstacles_in(const OccupiedSpace& space, double yaw,
                                         const OccupancyOptions& options = {});

}  // namespace stillmap
