// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/grid_checks.hpp"
#include "stillmap/slam.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr std::int8_t kUnknown = -1, kFree = 0, kOccupied = 100;
constexpr const char* kWhere = "navigation_grid";

/// Throws Error for options out of range.
void check(const NavigationGridOptions& options) {
  require_positive(options.cell, "the side of a cell", kWhere);
  if (!(options.lowest < options.highest))
    throw Error(fmt::format("the lowest height, {} m, is not below the highest, {} m",
                            options.lowest, options.highest),
                kWhere, "exchange them");
  require_not_negative(options.radius, "the radius of the robot", kWhere);
}

/// Returns the points in frame `map`.
std::vector<Eigen::Vector3d> in_map(const Cloud& cloud, const Pose& T_map_world) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(cloud.size());
  for (const Eigen::Vector3f& p : cloud.points) points.push_back(T_map_world * p.cast<double>());
  return points;
}

/// Marks cells of a grid by positions.
class Marker {
 public:
  Marker(const Eigen::AlignedBox2d& extent, double cell)
      : cell_(cell),
        first_((extent.min() / cell).array().floor().cast<int>()),
        size_((extent.max() / cell).array().floor().cast<int>() - first_ + 1) {}

  cv::Mat1b none() const { return cv::Mat1b(size_.y(), size_.x(), std::uint8_t{0}); }
  Eigen::Vector2d origin() const { return first_.cast<double>() * cell_; }
  void mark(const Eigen::Vector3d& p, cv::Mat1b& cells) const {
    const Eigen::Array2i at = (p.head<2>() / cell_).array().floor().cast<int>() - first_;
    cells(at.y(), at.x()) = 255;
  }

 private:
  double cell_;
  Eigen::Array2i first_, size_;
};

/// Returns the cells within a distance of marked ones [cells].
cv::Mat1b grown(const cv::Mat1b& cells, double distance) {
  cv::Mat1f distances;
  cv::distanceTransform(cells == 0, distances, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distances <= distance;
}

/// Returns the distances of cells from the nearest occupied one [m].
cv::Mat1f distances_from(const cv::Mat1b& occupied, double cell) {
  if (cv::countNonZero(occupied) == 0)
    return cv::Mat1f(occupied.size(), std::numeric_limits<float>::infinity());
  cv::Mat1f distances;
  cv::distanceTransform(occupied == 0, distances, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distances * cell;
}

}  // namespace

std::optional<NavigationGrid> navigation_grid(const Cloud& cloud,
                                              const std::vector<Eigen::Vector3d>& way,
                                              const Pose& T_map_world,
                                              const NavigationGridOptions& options) {
  check(options);
  const std::vector<Eigen::Vector3d> points = in_map(cloud, T_map_world);
  Eigen::AlignedBox2d extent;
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(options.radius + options.cell);
  const auto contain = [&](const Eigen::Vector3d& p) {
    extent.extend(p.head<2>() - margin);
    extent.extend(p.head<2>() + margin);
  };
  for (const Eigen::Vector3d& p : points) contain(p);
  for (const Eigen::Vector3d& at : way) contain(T_map_world * at);
  if (extent.isEmpty()) return std::nullopt;
  require_finite(points, kWhere);
  require_finite(way, kWhere);
  require_few_cells(Eigen::Vector2d(extent.sizes()), options.cell, kWhere);
  const Marker marker(extent, options.cell);
  cv::Mat1b occupied = marker.none(), floor = marker.none(), driven = marker.none();
  for (const Eigen::Vector3d& p : points) {
    if (p.z() >= options.lowest && p.z() <= options.highest) marker.mark(p, occupied);
    if (std::abs(p.z()) < options.lowest) marker.mark(p, floor);
  }
  for (const Eigen::Vector3d& at : way) marker.mark(T_map_world * at, driven);
  cv::morphologyEx(floor, floor, cv::MORPH_CLOSE, cv::Mat1b(3, 3, std::uint8_t{1}));
  NavigationGrid grid{
      options.cell, marker.origin(), cv::Mat_<std::int8_t>(floor.size(), kUnknown), {}};
  grid.cells.setTo(kFree, floor | grown(driven, options.radius / options.cell));
  grid.cells.setTo(kOccupied, occupied);
  grid.distances = distances_from(occupied, options.cell);
  return grid;
}

std::optional<double> NavigationGrid::distance_at(const Eigen::Vector2d& p_map) const {
  const Eigen::Vector2d at = (p_map - origin) / cell - Eigen::Vector2d::Constant(0.5);
  const int u = static_cast<int>(std::floor(at.x())), v = static_cast<int>(std::floor(at.y()));
  if (!(at.array().abs() < 1e9).all() || u < 0 || v < 0 || u + 1 >= cells.cols ||
      v + 1 >= cells.rows)
    return std::nullopt;
  const double a = at.x() - u, b = at.y() - v;
  return (1 - b) * ((1 - a) * distances(v, u) + a * distances(v, u + 1)) +
         b * ((1 - a) * distances(v + 1, u) + a * distances(v + 1, u + 1));
}

}  // namespace stillmap
