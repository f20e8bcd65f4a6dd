// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/occupancy.hpp"

#include "stillmap/base/error.hpp"

#include <cstdint>

namespace stillmap {
namespace {

/// Minimum number of points of the cloud in an occupied voxel.
constexpr int kMinPoints = 3;

constexpr int kRayStride = 4;  // every n-th pixel of a view casts a ray
constexpr int kFarViews = 2;   // least number of views of a cell that only far pixels measured

/// Marks the voxels between the camera center and a measured point, without the last one.
void cast_ray(const Eigen::Vector3d& eye, const Eigen::Vector3d& end, double edge,
              VoxelIndex& crossed) {
  const Eigen::Vector3d way = end - eye;
  const double length = way.norm() - edge;  // the surface may lie half a voxel nearer
  const double step = 0.5 * edge;
  for (double s = 0; s < length; s += step) {
    if (const auto voxel = voxel_at(eye + way * (s / way.norm()), edge)) crossed.add(*voxel);
  }
}

void cast_rays(const ViewAtPlace& placed, double edge, VoxelIndex& crossed) {
  const DenseView& view = *placed.view;
  for (int row = 0; row < view.depth.rows; row += kRayStride) {
    for (int col = 0; col < view.depth.cols; col += kRayStride) {
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      if (z <= 0) continue;
      cast_ray(placed.T_world_camera.translation(),
               placed.T_world_camera * view.camera.unproject(col, row, z), edge, crossed);
    }
  }
}

}  // namespace

OccupiedSpace occupied_space(const PlacedMap& placed, const Pose& T_map_world,
                             const OccupancyOptions& options) {
  OccupiedSpace space{.edge = options.cell, .occupied = {}, .free = {}};
  VoxelIndex index;
  std::vector<int> points;
  for (const std::uint32_t cell : placed.cells) {
    if (placed.grid->is_far(cell) && placed.grid->cell(cell).views < kFarViews) continue;
    const auto voxel = voxel_at(T_map_world * placed.grid->mean(cell).cast<double>(), options.cell);
    if (!voxel) continue;
    const std::uint32_t number = index.add(*voxel);
    points.resize(index.size(), 0);
    ++points[number];
  }
  VoxelIndex crossed;
  for (const ViewAtPlace& view : placed.views) {
    cast_rays({view.view, T_map_world * view.T_world_camera}, options.cell, crossed);
  }
  for (const std::uint32_t i : index.sorted()) {
    if (points[i] >= kMinPoints) space.occupied.push_back(index.voxel(i));
  }
  for (const std::uint32_t i : crossed.sorted()) {
    const std::uint32_t number = index.find(crossed.voxel(i));
    const bool taken = number != VoxelIndex::kNone && points[number] >= kMinPoints;
    if (!taken) space.free.push_back(crossed.voxel(i));
  }
  return space;
}

}  // namespace stillmap
