// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/site_frame.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/SVD>
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kSmallestWidth = 0.1;  // RMS distance of the points from a line [m]
constexpr double kMostScale = 1.05;     // ratio of the distances at the site and in the map

/// The points in both frames, as columns.
struct Columns {
  Eigen::Matrix3Xd map, site;
};

/// Returns the points without one of them; with all for an index beyond the last.
Columns columns_of(const std::vector<KnownPoint>& points, std::size_t left_out) {
  const auto count = static_cast<Eigen::Index>(points.size() - (left_out < points.size() ? 1 : 0));
  Columns columns{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == left_out) continue;
    columns.map.col(column) = points[i].p_map;
    columns.site.col(column++) = points[i].p_site;
  }
  return columns;
}

Eigen::Matrix3Xd centered(const Eigen::Matrix3Xd& points) {
  return points.colwise() - points.rowwise().mean();
}

/// Returns the RMS distance of points from the line that fits them best.
double width_of(const Eigen::Matrix3Xd& points) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(centered(points));
  return svd.singularValues().tail<2>().norm() / std::sqrt(static_cast<double>(points.cols()));
}

double scale_of(const Columns& columns) {
  return centered(columns.site).norm() / centered(columns.map).norm();
}

/// Returns the distances of points from their places at the site.
std::vector<double> errors_of(const Columns& columns, const Pose& T_site_map) {
  std::vector<double> errors;
  for (Eigen::Index i = 0; i < columns.map.cols(); ++i)
    errors.push_back((columns.site.col(i) - T_site_map * columns.map.col(i)).norm());
  return errors;
}

/// Returns the error from which points contradict each other.
double largest_error(const Columns& columns) {
  constexpr double kMeters = 0.1, kShare = 0.05;
  const double extent = centered(columns.site).norm() / std::sqrt(columns.site.cols());
  return std::max(kMeters, kShare * extent);
}

/// Returns the point without which the others fit each other; none if there is no such point.
const KnownPoint* outlier_of(const std::vector<KnownPoint>& points) {
  constexpr std::size_t kFewest = 4;
  if (points.size() < kFewest) return nullptr;
  const KnownPoint* outlier = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Columns others = columns_of(points, i);
    if (std::min(width_of(others.map), width_of(others.site)) < kSmallestWidth) continue;
    const double error = std::ranges::max(errors_of(others, align_points(others.site, others.map)));
    if (error >= least) continue;
    least = error;
    outlier = error <= largest_error(others) ? &points[i] : nullptr;
  }
  return outlier;
}

void require_alignable(const std::vector<KnownPoint>& points) {
  constexpr const char* kWhere = "known points";
  const Columns all = columns_of(points, points.size());
  if (all.map.cols() < 3)
    throw Error(fmt::format("there are {} points, too few for an alignment", all.map.cols()),
                kWhere, "give three or more points that are not on a line");
  if (std::min(width_of(all.map), width_of(all.site)) < kSmallestWidth)
    throw Error("lie on a line, so that the rotation about it is unknown", kWhere,
                "add a point at least a meter beside it");
  const double scale = scale_of(all);
  if (scale <= kMostScale && scale >= 1 / kMostScale) return;
  if (const KnownPoint* outlier = outlier_of(points))
    throw Error(
        fmt::format("{} does not fit the other points, which fit each other", outlier->name),
        kWhere, "check its coordinates in the map and at the site");
  throw Error(
      fmt::format("the distances between the points at the site are {:.3g} times those in the map",
                  scale),
      kWhere, "give both in meters, and check which point is which");
}

/// Returns the distance of a point from where the others have it; NaN if they lie on a line.
double error_by_others(const std::vector<KnownPoint>& points, std::size_t index) {
  const Columns others = columns_of(points, index);
  if (std::min(width_of(others.map), width_of(others.site)) < kSmallestWidth)
    return std::numeric_limits<double>::quiet_NaN();
  const Pose T_site_map = align_points(others.site, others.map);
  return (points[index].p_site - T_site_map * points[index].p_map).norm();
}

/// Returns the largest error of a point of which the others say where it should be (of three
/// points: of all). The geometric mean of its errors in the alignment with it and in that without
/// it: its error over the square root of its redundancy (Baarda 1968). So one by which the rotation
/// stands or falls is not blamed for the errors of the others.
double worst_error(const SiteAlignment& alignment) {
  if (alignment.errors_of_others.empty()) return std::ranges::max(alignment.errors);
  double worst = 0;
  for (std::size_t i = 0; i < alignment.errors.size(); ++i) {
    const double by_others = alignment.errors_of_others[i];
    if (!std::isnan(by_others)) worst = std::max(worst, std::sqrt(alignment.errors[i] * by_others));
  }
  return worst;
}

/// Returns SiteAlignment::contradiction.
std::string contradiction_of(const std::vector<KnownPoint>& points,
                             const SiteAlignment& alignment) {
  const double worst = worst_error(alignment);
  if (worst <= largest_error(columns_of(points, points.size()))) return {};
  if (const KnownPoint* outlier = outlier_of(points)) {
    const auto index = static_cast<std::size_t>(outlier - points.data());
    return fmt::format("{} is {:.0f} mm from where the other points have it: check its coordinates",
                       outlier->name, 1000 * alignment.errors_of_others[index]);
  }
  return fmt::format(
      "the points contradict each other by up to {:.0f} mm: check which point is which, and that "
      "the axes of the site are right-handed",
      1000 * worst);
}

}  // namespace

bool is_at_site(const MapContent& map, std::uint32_t component) {
  // A merge may replace the first keyframe by one that shows the same.
  constexpr double kSamePlace = 0.3, kSameDirection = 0.2;  // [m], [rad]
  const auto first = map.first.find(component);
  if (first == map.first.end()) return false;
  const Pose& T_world_first = map.keyframes[first->second.slot].T_world_camera;
  return T_world_first.translation().norm() > kSamePlace || T_world_first.angle() > kSameDirection;
}

SiteAlignment align_to_site(const std::vector<KnownPoint>& points) {
  require_alignable(points);
  const Columns all = columns_of(points, points.size());
  SiteAlignment alignment{.T_site_map = align_points(all.site, all.map)};
  alignment.errors = errors_of(all, alignment.T_site_map);
  if (points.size() > 3) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      alignment.errors_of_others.push_back(error_by_others(points, i));
    }
  }
  alignment.contradiction = contradiction_of(points, alignment);
  return alignment;
}

SiteAlignment align_to_plan(std::vector<KnownPoint> points, const Pose& T_level_map) {
  for (KnownPoint& point : points) {
    point.p_map = T_level_map * point.p_map;
    point.p_map.z() = 0;
  }
  SiteAlignment alignment = align_to_site(points);
  if (alignment.T_site_map.rotation()(2, 2) < 0)
    throw Error("are mirrored on the plan", "known points",
                "check which point is which, and that columns count to the right and rows down");
  alignment.T_site_map = alignment.T_site_map * T_level_map;
  return alignment;
}

std::string reason_against_up(const MapContent& map, std::uint32_t component) {
  constexpr double kTurnedOver = -0.5;
  double up = 0, count = 0;
  for (const Keyframe& k : map.keyframes) {
    if (k.component != component) continue;
    up -= (k.T_world_camera.quaternion() * Eigen::Vector3d::UnitY()).z();
    ++count;
  }
  if (count == 0 || up > kTurnedOver * count) return {};
  return "the cameras are upside down at the site: Z must point up, and X, Y, Z be right-handed";
}

void move_world(MapContent& map, std::uint32_t component, const Pose& T) {
  for (Landmark& l : map.landmarks) {
    if (component_of(map, l) != component) continue;
    l.p_world = T * l.p_world;
    l.normal = T.quaternion() * l.normal;
  }
  for (Keyframe& k : map.keyframes) {
    if (k.component == component) k.T_world_camera = T * k.T_world_camera;
  }
}

}  // namespace stillmap
