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

/// Returns the extent of a box along a direction [m].
double extent(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& direction) {
  return box.sizes().dot(direction.cwiseAbs());
}

}  // namespace

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

bool reaches_into(const Zone& zone, const Eigen::Vector3d& centroid,
                  const Eigen::AlignedBox3d& box) {
  const double floor = zone.up.dot(zone.polygon.front());
  const double middle = zone.up.dot(box.center()) - floor, half = extent(box, zone.up) / 2;
  if (middle + half < zone.low || middle - half > zone.high) return false;
  const LevelAxes axes = level_axes(zone.up);
  // The axes are arbitrary; the smaller of both extents is never wider than the object's diagonal.
  const double radius = std::min(extent(box, axes.u), extent(box, axes.v)) / 2;
  return level_distance(zone, centroid) <= radius;
}

}  // namespace stillmap
