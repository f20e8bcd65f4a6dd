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
  double confidence = 0;             ///< A class of a lower confidence counts as "unknown" [0..1].
};

/// Returns why the corners of a zone are no polygon on a floor: too far away, on a line as seen
/// along `up`, not level, or with edges that cross. Empty if they are one.
std::string polygon_problem(const Zone& zone);

/// The space of a mover. It does not depend on the axes of the world, unlike a box along them,
/// which is far too large for an upright person in the world of a camera that looks down.
struct UprightCylinder {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< World frame [m].
  double radius = 0, height = 0;                     ///< [m]
};

/// Returns the cylinder whose box along the axes of the world has, in the sense of least squares,
/// the extents of a given box: those along axis i are height |up_i| + 2 radius sqrt(1 - up_i^2).
/// @param axis  a point on the axis of the cylinder; its height is that of the box
UprightCylinder cylinder_in(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& axis,
                            const Eigen::Vector3d& up);

/// Returns the distance of a point from a cylinder, in space or along the floor; 0 inside [m].
double distance_of(const UprightCylinder& cylinder, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& up, bool level);

/// Returns the distance of a point from the polygon, both projected along `up`; 0 inside [m].
double level_distance(const Zone& zone, const Eigen::Vector3d& point);

/// Returns whether an object reaches into a zone.
bool reaches_into(const Zone& zone, const UprightCylinder& object);

}  // namespace stillmap
