// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stillmap {

/// A part of the space above a polygon. World frame, meters.
struct Zone {
  std::string name;
  std::vector<Eigen::Vector3d>
      polygon;                       ///< At least three corners, on the floor or parallel to it.
  double low = 0, high = 2.5;        ///< Heights above the polygon [m].
  Eigen::Vector3d up = {0, -1, 0};   ///< Unit vector; the polygon is projected along it.
  std::vector<std::string> classes;  ///< Classes of movers that it is for; empty: all.
};

/// Returns the distance of a point from the polygon, both projected along `up`; 0 inside [m].
double level_distance(const Zone& zone, const Eigen::Vector3d& point);

/// Returns whether an object reaches into a zone: its upright cylinder, of half the smaller of the
/// box's two level extents, and as high as the box.
/// @param centroid  axis of the cylinder
/// @param box       box around the object along the axes of the world
bool reaches_into(const Zone& zone, const Eigen::Vector3d& centroid,
                  const Eigen::AlignedBox3d& box);

}  // namespace stillmap
