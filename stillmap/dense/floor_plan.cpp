// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Obstacles that are smaller than this in all directions are left out [m].
constexpr double kMinObstacle = 0.15;

constexpr std::uint8_t kGridOccupied = 0, kGridUnknown = 205, kGridFree = 254;  // of map_server

struct Column {
  bool occupied = false, free = false, floor = false;
  double low = std::numeric_limits<double>::infinity(), high = -low;  // of occupied voxels [m]
};

/// Columns of voxels by the coordinates of their cell in frame `map` [cells].
using Columns = std::map<std::pair<int, int>, Column>;

Columns columns_of(const OccupiedSpace& space, const OccupancyOptions& options) {
  Columns columns;
  const auto column_at = [&](const Eigen::Vector3d& p) -> Column& {
    return columns[{static_cast<int>(std::floor(p.x() / options.cell)),
                    static_cast<int>(std::floor(p.y() / options.cell))}];
  };
  for (const Voxel voxel : space.occupied) {
    const Eigen::Vector3d p = center_of(voxel, space.edge);
    if (p.z() > options.highest || p.z() < -options.lowest) continue;
    Column& column = column_at(p);
    if (p.z() < options.lowest) {
      column.floor = true;
      continue;
    }
    column.occupied = true;
    column.low = std::min(column.low, p.z() - space.edge / 2);
    column.high = std::max(column.high, p.z() + space.edge / 2);
  }
  for (const Voxel voxel : space.free) {
    const Eigen::Vector3d p = center_of(voxel, space.edge);
    if (p.z() >= options.lowest && p.z() <= options.highest) column_at(p).free = true;
  }
  return columns;
}

OccupancyGrid drawn(const Columns& columns, double cell) {
  OccupancyGrid grid;
  grid.resolution = cell;
  if (columns.empty()) return grid;
  int low_x = std::numeric_limits<int>::max(), low_y = low_x, high_x = -low_x, high_y = -low_x;
  for (const auto& [place, column] : columns) {
    low_x = std::min(low_x, place.first), high_x = std::max(high_x, place.first);
    low_y = std::min(low_y, place.second), high_y = std::max(high_y, place.second);
  }
  grid.origin = {low_x * cell, low_y * cell};
  grid.image = cv::Mat1b(high_y - low_y + 1, high_x - low_x + 1, kGridUnknown);
  for (const auto& [place, column] : columns) {
    std::uint8_t& pixel = grid.image(high_y - place.second, place.first - low_x);
    if (column.free || column.floor) pixel = kGridFree;
    if (column.occupied) pixel = kGridOccupied;
  }
  return grid;
}

std::vector<StaticObstacle> obstacles_in(const Columns& columns, const OccupancyGrid& grid,
                                         double smallest) {
  if (grid.image.empty()) return {};
  cv::Mat1i labels;
  const int count = cv::connectedComponents(grid.image == kGridOccupied, labels, 8, CV_32S);
  std::vector<StaticObstacle> found(static_cast<std::size_t>(count));
  const int low_x = cvRound(grid.origin.x() / grid.resolution);
  const int low_y = cvRound(grid.origin.y() / grid.resolution);
  for (const auto& [place, column] : columns) {
    if (!column.occupied) continue;
    const int label = labels(labels.rows - 1 - (place.second - low_y), place.first - low_x);
    const Eigen::Vector2d corner(place.first * grid.resolution, place.second * grid.resolution);
    const Eigen::Vector2d opposite = corner.array() + grid.resolution;
    auto& box = found[static_cast<std::size_t>(label)].box;
    box.extend(Eigen::Vector3d(corner.x(), corner.y(), column.low));
    box.extend(Eigen::Vector3d(opposite.x(), opposite.y(), column.high));
  }
  std::erase_if(found, [&](const StaticObstacle& obstacle) {
    return obstacle.box.isEmpty() || obstacle.box.sizes().maxCoeff() < smallest;
  });
  const auto area = [](const StaticObstacle& o) { return o.box.sizes().head<2>().prod(); };
  std::stable_sort(found.begin(), found.end(),
                   [&](const auto& a, const auto& b) { return area(a) > area(b); });
  for (std::size_t i = 0; i < found.size(); ++i) found[i].id = static_cast<int>(i + 1);
  return found;
}

}  // namespace

FloorPlan floor_plan(const OccupiedSpace& space, const OccupancyOptions& options) {
  const Columns columns = columns_of(space, options);
  FloorPlan plan{.grid = drawn(columns, options.cell), .obstacles = {}};
  plan.obstacles = obstacles_in(columns, plan.grid, kMinObstacle);
  return plan;
}

}  // namespace stillmap
