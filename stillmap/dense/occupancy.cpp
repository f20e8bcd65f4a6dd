// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/occupancy.hpp"

#include <cstdint>

namespace stillmap {
namespace {

/// Minimum number of points of the cloud in an occupied voxel.
constexpr int kMinPoints = 3;

/// Distance of the pixels of a view that cast a ray [pixels].
constexpr int kRayStride = 4;
/// Minimum number of views of a cell that consists of far pixels only.
constexpr int kFarViews = 2;

/// Marks the voxels between the camera center and a measured point, without the last one.
void cast_ray(const Eigen::Vector3d& eye, const Eigen::Vector3d& end, double edge,
              VoxelIndex& crossed) {
  const Eigen::Vector3d path = end - eye;
  const double length = path.norm() - edge;  // The surface may be half a voxel nearer.
  const double step = 0.5 * edge;
  for (double s = 0; s < length; s += step) {
    if (const auto voxel = voxel_at(eye + path * (s / path.norm()), edge)) crossed.add(*voxel);
  }
}

void cast_rays(const PosedView& placed, double edge, VoxelIndex& crossed) {
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
  for (std::size_t i = 0; i < placed.cells.size(); ++i) {
    const std::uint32_t cell = placed.cells[i];
    if (placed.grid->is_far(cell) && placed.grid->cell(cell).views < kFarViews) continue;
    const auto voxel = voxel_at(T_map_world * placed.points[i].cast<double>(), options.cell);
    if (!voxel) continue;
    const std::uint32_t number = index.add(*voxel);
    points.resize(index.size(), 0);
    ++points[number];
  }
  VoxelIndex crossed;
  for (const PosedView& view : placed.views) {
    cast_rays({view.view, T_map_world * view.T_world_camera}, options.cell, crossed);
    view.view->drop_pages();
  }
  for (const std::uint32_t i : index.sorted()) {
    if (points[i] >= kMinPoints) space.occupied.push_back(index.voxel(i));
  }
  for (const std::uint32_t i : crossed.sorted()) {
    const std::uint32_t number = index.find(crossed.voxel(i));
    const bool occupied = number != VoxelIndex::kNone && points[number] >= kMinPoints;
    if (!occupied) space.free.push_back(crossed.voxel(i));
  }
  return space;
}

}  // namespace stillmap
