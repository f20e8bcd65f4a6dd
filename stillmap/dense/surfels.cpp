// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/surfels.hpp"

#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace stillmap {
namespace {

/// Distance of the neighbors whose difference gives a normal [pixels of a view].
constexpr int kReach = 4;
/// Number of pixels with a normal in a row; all pixels of smaller views have one.
constexpr int kNormalsPerRow = 160;
/// Largest deviation of a pixel from the straight line between its neighbors, relative to its
/// depth. It excludes edges and corners.
constexpr double kStraight = 0.01;
/// Minimum number of normals in a surfel.
constexpr int kMinNormals = 3;
/// Minimum length of the mean of the unit normals in a surfel; 0.9 is a spread of about 25 degrees.
constexpr double kAgreement = 0.9;

struct Sum {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  int count = 0;
};

/// Returns the point of a static pixel, camera frame [m].
std::optional<Eigen::Vector3d> static_point(const DenseView& view, int row, int col) {
  if (view.depth(row, col) == 0 || !view.is_static(row, col)) return std::nullopt;
  return view.camera.unproject(col, row, view.depth(row, col) * double{DenseView::kDepthUnit});
}

/// Returns the vector between the neighbors of a pixel in one direction, if the three pixels lie on
/// a straight line.
std::optional<Eigen::Vector3d> tangent(const DenseView& view, int row, int col, int down,
                                       int right) {
  const auto before = static_point(view, row - down, col - right);
  const auto at = static_point(view, row, col);
  const auto after = static_point(view, row + down, col + right);
  if (!before || !at || !after) return std::nullopt;
  if (((*before + *after) / 2 - *at).norm() > kStraight * at->z()) return std::nullopt;
  return *after - *before;
}

/// Returns the unit normal of a pixel towards the camera, camera frame.
std::optional<Eigen::Vector3d> normal_at(const DenseView& view, int row, int col) {
  const auto right = tangent(view, row, col, 0, kReach), down = tangent(view, row, col, kReach, 0);
  if (!right || !down) return std::nullopt;
  const Eigen::Vector3d normal = down->cross(*right);
  if (normal.norm() < 1e-12) return std::nullopt;
  return normal.normalized();
}

void add_view(const PosedView& placed, double edge, VoxelIndex& cubes, std::vector<Sum>& sums) {
  const DenseView& view = *placed.view;
  const Eigen::Matrix3d R_world_camera = placed.T_world_camera.rotation();
  const int step = std::max(1, view.depth.cols / kNormalsPerRow);
  for (int row = kReach; row < view.depth.rows - kReach; row += step) {
    for (int col = kReach; col < view.depth.cols - kReach; col += step) {
      const auto normal = normal_at(view, row, col);
      if (!normal) continue;
      const Eigen::Vector3d point = placed.T_world_camera * *static_point(view, row, col);
      const auto cube = voxel_at(point, edge);
      if (!cube) continue;
      const std::uint32_t number = cubes.add(*cube);
      sums.resize(cubes.size());
      sums[number].point += point;
      sums[number].normal += R_world_camera * *normal;
      ++sums[number].count;
    }
  }
}

}  // namespace

std::vector<Surfel> surfels_of(const PlacedMap& placed, double edge) {
  VoxelIndex cubes;
  std::vector<Sum> sums;
  for (const PosedView& view : placed.views) add_view(view, edge, cubes, sums);
  std::vector<Surfel> surfels;
  for (const std::uint32_t i : cubes.sorted()) {
    const Sum& sum = sums[i];
    if (sum.count < kMinNormals || sum.normal.norm() < kAgreement * sum.count) continue;
    surfels.push_back({sum.point / sum.count, sum.normal.normalized()});
  }
  return surfels;
}

}  // namespace stillmap
