// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/zone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stillmap {
namespace {

/// Coordinates along and across the floor.
struct LevelAxes {
  Eigen::Vector3d u, v;
  Eigen::Vector2d of(const Eigen::Vector3d& p) const { return {u.dot(p), v.dot(p)}; }
};

LevelAxes level_axes(const Eigen::Vector3d& up) {
  const Eigen::Vector3d u = up.unitOrthogonal();
  return {u, up.cross(u)};
}

double distance_to_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                        const Eigen::Vector2d& b) {
  const Eigen::Vector2d edge = b - a;
  const double length = edge.squaredNorm();
  const double s = length > 0 ? std::clamp((p - a).dot(edge) / length, 0.0, 1.0) : 0.0;
  return (p - a - s * edge).norm();
}

}  // namespace

UprightCylinder cylinder_in(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& axis,
                            const Eigen::Vector3d& up) {
  Eigen::Matrix<double, 3, 2> extents;  // of a cylinder of height 1 and of one of radius 1
  extents.col(0) = up.cwiseAbs();
  extents.col(1) = 2 * (1 - up.array().square()).max(0).sqrt();
  Eigen::Vector2d size = extents.colPivHouseholderQr().solve(box.sizes());
  for (int i = 0; i < 2; ++i) {  // neither is negative
    if (size[i] >= 0) continue;
    size[i] = 0;
    size[1 - i] = extents.col(1 - i).dot(box.sizes()) / extents.col(1 - i).squaredNorm();
  }
  return {.center = axis + up * up.dot(box.center() - axis), .radius = size[1], .height = size[0]};
}

double distance_of(const UprightCylinder& cylinder, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& up, bool level) {
  const Eigen::Vector3d apart = point - cylinder.center;
  const double height = up.dot(apart);
  const double beside = std::max(0.0, (apart - height * up).norm() - cylinder.radius);
  return level ? beside : std::hypot(beside, std::max(0.0, std::abs(height) - cylinder.height / 2));
}

double level_distance(const Zone& zone, const Eigen::Vector3d& point) {
  const LevelAxes axes = level_axes(zone.up);
  const Eigen::Vector2d p = axes.of(point);
  bool inside = false;
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Vector2d a = axes.of(zone.polygon.back());
  for (const Eigen::Vector3d& corner : zone.polygon) {
    const Eigen::Vector2d b = axes.of(corner);
    // A ray along the first axis crosses the edge: even-odd rule.
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
    nearest = std::min(nearest, distance_to_edge(p, a, b));
    a = b;
  }
  return inside ? 0 : nearest;
}

bool reaches_into(const Zone& zone, const UprightCylinder& object) {
  const double floor = zone.up.dot(zone.polygon.front());
  const double middle = zone.up.dot(object.center) - floor, half = object.height / 2;
  if (middle + half < zone.low || middle - half > zone.high) return false;
  return level_distance(zone, object.center) <= object.radius;
}

}  // namespace stillmap
