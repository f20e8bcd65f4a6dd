// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/map_mesh.hpp"

#include "stillmap/dense/mesh_simplification.hpp"
#include "stillmap/dense/placed_view.hpp"
#include "stillmap/dense/surface_refinement.hpp"
#include "stillmap/dense/view_colors.hpp"
#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace stillmap {

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

namespace {

/// Returns the depth [m] at which the ray of a far pixel meets a far surface of the map within the
/// noise of its depth; 0 if there is none.
double far_depth(const PlacedView& placed, int row, int col, const StaticGrid& grid) {
  const std::uint32_t cell = grid.far_cell_on_ray(
      placed, row, col, [&](std::uint32_t number) { return grid.is_static(number); });
  return cell == VoxelIndex::kNone ? 0 : placed.in_camera(grid.mean(cell)).z();
}

/// A view whose far pixels have the depths of the map, and the pixels with a surface of the map.
struct MeshView {
  DenseView view;
  cv::Mat1b surface;
};

MeshView mesh_view(const PosedView& posed, const StaticGrid& grid) {
  MeshView result{*posed.view, static_pixels(posed, grid)};
  result.view.depth = posed.view->depth.clone();
  const PlacedView placed(*posed.view, posed.T_world_camera);
  for (int row = 0; row < result.surface.rows; ++row) {
    for (int col = 0; col < result.surface.cols; ++col) {
      if (posed.view->kind(row, col) != kFarSurface) continue;
      const double z = far_depth(placed, row, col, grid);
      if (z <= 0) continue;
      result.view.depth(row, col) = packed_depth(static_cast<float>(z));
      result.surface(row, col) = 255;
    }
  }
  return result;
}

/// Connected parts with fewer triangles are left out.
constexpr std::size_t kMinTriangles = 200;
/// Distance of the triangles for looking at from the mesh, and side of the texels [voxels].
constexpr double kSimplification = 0.3, kTexel = 0.3;

/// Adds the voxels that are at most `reach` steps to a neighbor away from one.
void add_around(const Lattice& voxel, int reach, VoxelIndex& index) {
  for (int x = -reach; x <= reach; ++x) {
    for (int y = std::abs(x) - reach; y <= reach - std::abs(x); ++y) {
      const int rest = reach - std::abs(x) - std::abs(y);
      for (int z = -rest; z <= rest; ++z) index.add(voxel_of(voxel + Lattice(x, y, z)));
    }
  }
}

/// Returns the mesh without the triangles that are not at points of the map: along outlines, the
/// distances of views from several sides may be zero where there is no surface.
/// @param voxel_edge  of the mesh [m]; the voxels of the map may be finer than its points are dense
TriangleMesh at_points(TriangleMesh mesh, const PlacedMap& placed, double voxel_edge) {
  constexpr int kReach = 1, kFarReach = 5;  // far points are further apart, and less exact [voxels]
  const double edge = std::max(voxel_edge, placed.grid->edge());
  VoxelIndex near;
  for (std::size_t i = 0; i < placed.points.size(); ++i) {
    const auto voxel = voxel_at(placed.points[i].cast<double>(), edge);
    const int reach = placed.grid->is_far(placed.cells[i]) ? kFarReach : kReach;
    if (voxel) add_around(lattice_of(*voxel), reach, near);
  }
  const auto is_near = [&](std::uint32_t vertex) {
    const auto voxel = voxel_at(mesh.vertices[vertex].cast<double>(), edge);
    return voxel && near.find(*voxel) != VoxelIndex::kNone;
  };
  std::erase_if(mesh.triangles,
                [&](const auto& triangle) { return !std::ranges::all_of(triangle, is_near); });
  return without_specks(mesh, kMinTriangles);
}

}  // namespace

TriangleMesh make_mesh(const PlacedMap& placed, const MeshOptions& options) {
  TsdfVolume volume(options);
  for (const PosedView& posed : placed.views) {
    const auto [view, surface] = mesh_view(posed, *placed.grid);
    volume.integrate(view, posed.T_world_camera, surface);
    posed.view->drop_pages();
  }
  TriangleMesh mesh = volume.mesh();
  mesh.vertices = refined_points(mesh.vertices, placed.views);
  mesh = at_points(std::move(mesh), placed, options.voxel);
  mesh.colors = surface_colors(mesh.vertices, placed.views, placed.gains);
  return mesh;
}

TexturedMesh make_textured_mesh(const TriangleMesh& mesh, const PlacedMap& placed,
                                const MeshOptions& options) {
  const PointColors photo_colors = [&](const std::vector<Eigen::Vector3f>& points) {
    return surface_colors(points, placed.views, placed.gains, ColorSource::kPhoto);
  };
  return textured(simplified(mesh, kSimplification * options.voxel), kTexel * options.voxel,
                  photo_colors);
}

}  // namespace stillmap
