// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/map_mesh.hpp"

#include "stillmap/dense/voxel_index.hpp"

namespace stillmap {
namespace {

/// Returns 255 for each pixel of a view whose voxel is in the static map.
cv::Mat1b static_pixels(const PosedView& placed, const StaticGrid& grid) {
  const DenseView& view = *placed.view;
  const Eigen::Matrix3d R = placed.T_world_camera.rotation();
  cv::Mat1b pixels = cv::Mat1b::zeros(view.depth.size());
  for (int row = 0; row < pixels.rows; ++row) {
    for (int col = 0; col < pixels.cols; ++col) {
      if (!view.is_static(row, col)) continue;
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      const auto voxel =
          voxel_at(R * view.camera.unproject(col, row, z) + placed.T_world_camera.translation(),
                   grid.edge());
      if (!voxel) continue;
      const std::uint32_t cell = grid.index().find(*voxel);
      if (cell != VoxelIndex::kNone && grid.is_static(cell)) pixels(row, col) = 255;
    }
  }
  return pixels;
}

}  // namespace

TriangleMesh make_mesh(const PlacedMap& placed, const MeshOptions& options) {
  TsdfVolume volume(options);
  for (std::size_t i = 0; i < placed.views.size(); ++i) {
    const PosedView& view = placed.views[i];
    volume.integrate(*view.view, view.T_world_camera, static_pixels(view, *placed.grid),
                     placed.grid->gains()[i]);
    view.view->drop_pages();
  }
  return volume.mesh();
}

}  // namespace stillmap
