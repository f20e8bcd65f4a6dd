// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/mesh.hpp"
#include "stillmap/dense/mesh_options.hpp"
#include "stillmap/dense/voxel_index.hpp"
#include "stillmap/geometry/pose.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// A truncated signed distance field (Curless and Levoy 1996) in blocks of 8^3 voxels where there
/// is surface: every view gives the voxels in view their distance in front of (+) or behind (-) the
/// surface on their ray, and the mean, weighted by 1 / sigma^2 of the depth, is zero on the
/// surface. So noise averages out, and the space in front of an observed surface becomes free.
///
/// Not Open3D's ScalableTSDFVolume, which has no weights that fall with depth, accepts no views
/// with partly known surfaces, returns its triangles in the order of a std::unordered_map, and
/// depends on VTK, Filament, Embree and a second C++ library.
///
/// The result depends on the views, their poses and their order. One thread at a time.
class TsdfVolume {
 public:
  /// Throws Error if an option is out of range.
  explicit TsdfVolume(const MeshOptions& options = {});

  /// Adds a view.
  /// @param surface image of the view's size, not zero for pixels of a surface to be kept; other
  ///   pixels only give the free space in front of their depth
  void integrate(const DenseView& view, const Pose& T_world_camera, const cv::Mat1b& surface);

  /// Returns the surface of distance zero by surface nets (Gibson, MERL TR-99-24, 1999): a vertex
  /// in every cube of eight voxels that it crosses, at the mean of its intersections with the
  /// cube's edges, and a quadrangle of two triangles around every edge that it crosses. It has no
  /// colors.
  TriangleMesh mesh() const;

  static constexpr int kSide = 8;  ///< Side of a block [voxels].

 private:
  struct Voxel8 {
    float distance = 0;  // [truncation distances]
    float weight = 0;
  };
  using Block = std::array<Voxel8, kSide * kSide * kSide>;

  void allocate(const DenseView& view, const Pose& T_world_camera, const cv::Mat1b& surface);
  void update(Block& block, const Eigen::Vector3d& corner, const DenseView& view,
              const Pose& T_camera_world, const cv::Mat1b& surface);
  void update_voxel(Voxel8& voxel, float ahead, float weight, bool on_surface) const;
  const Voxel8* at(const Lattice& voxel) const;

  friend class SurfaceNets;
  MeshOptions options_;
  VoxelIndex index_;
  std::vector<Block> blocks_;
};

}  // namespace stillmap
