// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/zone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/SVD>
#include <fmt/format.h>

namespace stillmap {
namespace {

// Limits of polygons. They only refuse mistakes: swapped axes, wrong units, a wrong `up`.
constexpr double kFarthest = 1e4;    // greatest coordinate of a corner [m]
constexpr double kNarrowest = 0.05;  // least RMS distance of the corners from their best line [m]
constexpr double kRise = 0.5;        // greatest difference of the corners' heights [m] ...
constexpr double kSlope = 0.2;       // ... plus this share of the zone's extent

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

using LevelPolygon = Eigen::Matrix2Xd;

LevelPolygon level_polygon(const Zone& zone) {
  const LevelAxes axes = level_axes(zone.up);
  LevelPolygon polygon(2, zone.polygon.size());
  for (Eigen::Index i = 0; i < polygon.cols(); ++i)
    polygon.col(i) = axes.of(zone.polygon[static_cast<std::size_t>(i)]);
  return polygon;
}

/// Returns the RMS distance of the corners from the line that fits them best [m].
double width_of(const LevelPolygon& polygon) {
  const LevelPolygon centered = polygon.colwise() - polygon.rowwise().mean();
  return Eigen::JacobiSVD<LevelPolygon>(centered).singularValues()[1] /
         std::sqrt(static_cast<double>(polygon.cols()));
}

/// Whether the points c and d are on different sides of the line from a to b.
bool parts(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
           const Eigen::Vector2d& d) {
  const auto side = [&](const Eigen::Vector2d& p) {
    return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
  };
  return side(c) * side(d) < 0;
}

bool has_crossing(const LevelPolygon& polygon) {
  const Eigen::Index n = polygon.cols();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i + 2; j < n; ++j) {
      const Eigen::Vector2d a = polygon.col(i), b = polygon.col(i + 1), c = polygon.col(j),
                            d = polygon.col((j + 1) % n);
      if (parts(a, b, c, d) && parts(c, d, a, b)) return true;
    }
  }
  return false;
}

}  // namespace

std::string polygon_problem(const Zone& zone) {
  Eigen::AlignedBox1d heights;
  for (const Eigen::Vector3d& corner : zone.polygon) {
    if (corner.cwiseAbs().maxCoeff() > kFarthest)
      return fmt::format("has a coordinate beyond {} m", kFarthest);
    heights.extend(Eigen::AlignedBox1d::VectorType(zone.up.dot(corner)));
  }
  const LevelPolygon polygon = level_polygon(zone);
  const std::string up =
      fmt::format("'up' [{:.3g}, {:.3g}, {:.3g}]", zone.up.x(), zone.up.y(), zone.up.z());
  if (width_of(polygon) < kNarrowest)
    return "is a line as seen along " + up + ": its corners are on a line, or it is vertical";
  const double extent = (polygon.rowwise().maxCoeff() - polygon.rowwise().minCoeff()).norm();
  const double rise = heights.sizes().x();
  if (rise > kRise + kSlope * extent)
    return fmt::format("is not level: the heights of its corners along {} differ by {:.2f} m", up,
                       rise);
  return has_crossing(polygon) ? "has edges that cross" : "";
}

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
