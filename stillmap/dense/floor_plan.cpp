// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

namespace stillmap {
namespace {

constexpr std::uint8_t kGridOccupied = 0, kGridUnknown = 205, kGridFree = 254;  // of map_server

struct Column {
  bool occupied = false, free = false, floor = false;
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

}  // namespace

OccupancyGrid floor_plan(const OccupiedSpace& space, const OccupancyOptions& options) {
  return drawn(columns_of(space, options), options.cell);
}

}  // namespace stillmap
