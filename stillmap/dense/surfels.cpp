// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/surfels.hpp"

#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>

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

/// Minimum number of points of a cloud in 3 x 3 x 3 cubes, to fit a plane to them.
constexpr int kMinPoints = 6;
/// Largest ratio of the standard deviations of points across a plane and along its narrow
/// direction.
constexpr double kFlat = 0.25;

/// Moments of points about an origin.
struct Moments {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();      // [m]
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();  // [m^2]
  int count = 0;
  void add(const Moments& other) {
    sum += other.sum;
    squares += other.squares;
    count += other.count;
  }
};

/// Returns the unit normal of the plane through points, of either sign; none if they are not flat.
std::optional<Eigen::Vector3d> plane_normal(const Moments& moments) {
  if (moments.count < kMinPoints) return std::nullopt;
  const Eigen::Vector3d mean = moments.sum / moments.count;
  const Eigen::Matrix3d spread = moments.squares / moments.count - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(spread);
  const Eigen::Vector3d variances = solver.eigenvalues();
  if (variances(0) > kFlat * kFlat * variances(1)) return std::nullopt;
  return solver.eigenvectors().col(0);
}

/// Returns the vector from a point to the nearest camera [m].
Eigen::Vector3d towards_nearest(const std::vector<Eigen::Vector3d>& eyes,
                                const Eigen::Vector3d& point) {
  Eigen::Vector3d nearest = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  for (const Eigen::Vector3d& eye : eyes) {
    const Eigen::Vector3d way = eye - point;
    if (way.squaredNorm() < nearest.squaredNorm()) nearest = way;
  }
  return nearest;
}

/// The points of a cloud by cubes.
struct CubedCloud {
  VoxelIndex cubes;
  std::vector<Moments> moments;                      // of each cube, about `origin`
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // the first point
};

CubedCloud cubed(const Cloud& cloud, double edge) {
  CubedCloud result;
  if (!cloud.empty()) result.origin = cloud.points.front().cast<double>();
  const std::size_t step = 1 + cloud.size() / kMaxSurfelPoints;
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    const Eigen::Vector3d point = cloud.points[i].cast<double>();
    const auto cube = voxel_at(point, edge);
    if (!cube) continue;
    const std::uint32_t number = result.cubes.add(*cube);
    result.moments.resize(result.cubes.size());
    const Eigen::Vector3d p = point - result.origin;
    result.moments[number].add({p, p * p.transpose(), 1});
  }
  return result;
}

/// Returns the moments of the 3 x 3 x 3 cubes around a cube.
Moments moments_around(const CubedCloud& cloud, Voxel middle) {
  Moments around;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const std::uint32_t near =
            cloud.cubes.find(voxel_of(lattice_of(middle) + Lattice(x, y, z)));
        if (near != VoxelIndex::kNone) around.add(cloud.moments[near]);
      }
    }
  }
  return around;
}

}  // namespace

std::vector<Surfel> surfels_of(const Cloud& cloud, const std::vector<Eigen::Vector3d>& eyes,
                               double edge) {
  const CubedCloud cubed_cloud = cubed(cloud, edge);
  std::vector<Surfel> surfels;
  for (const std::uint32_t i : cubed_cloud.cubes.sorted()) {
    const Moments& own = cubed_cloud.moments[i];
    const auto normal = plane_normal(moments_around(cubed_cloud, cubed_cloud.cubes.voxel(i)));
    if (!normal) continue;
    const Eigen::Vector3d point = cubed_cloud.origin + own.sum / own.count;
    const bool away = !eyes.empty() && normal->dot(towards_nearest(eyes, point)) < 0;
    surfels.push_back({point, away ? Eigen::Vector3d(-*normal) : *normal});
  }
  return surfels;
}

std::vector<Surfel> surfels_of(const PlacedMap& placed, double edge) {
  VoxelIndex cubes;
  std::vector<Sum> sums;
  for (const PosedView& view : placed.views) {
    add_view(view, edge, cubes, sums);
    view.view->drop_pages();
  }
  std::vector<Surfel> surfels;
  for (const std::uint32_t i : cubes.sorted()) {
    const Sum& sum = sums[i];
    if (sum.count < kMinNormals || sum.normal.norm() < kAgreement * sum.count) continue;
    surfels.push_back({sum.point / sum.count, sum.normal.normalized()});
  }
  return surfels;
}

}  // namespace stillmap
