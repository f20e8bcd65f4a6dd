// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/registration.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr double kEdge = 0.05;  ///< Side of the surface's voxels [m].
/// Distance of the used pixels in both directions: of points of the surface, and of points that are
/// registered [pixels of the view].
constexpr int kSurfaceStep = 2, kPointStep = 3;
/// Distance of the pixels from which a normal is computed [pixels of the view].
constexpr int kNormalReach = 3;
/// Largest second difference of the points from which a normal is computed, in units of the depth:
/// beyond it they belong to two surfaces.
constexpr double kMaxBend = 0.03;
/// Smallest length of the mean of a voxel's unit normals for a plane, and smallest cosine between
/// the normals of a point and its plane.
constexpr double kFlat = 0.8, kMinCosine = 0.8;
constexpr int kIterations = 10;
constexpr double kConverged = 1e-5;  ///< Change of the pose that ends the iterations [m, rad].
constexpr int kMinPoints = 50;
/// Largest correction of a pose [m], [rad].
constexpr double kMaxShift = 0.1, kMaxTurn = 0.087;
/// Standard deviations of a correction step [m], [rad]: they keep a pose where the surface does not
/// determine it.
constexpr double kShiftSigma = 0.02, kTurnSigma = 0.01;
/// Residual above which a point's influence decreases, in standard deviations (Huber).
constexpr double kHuber = 1.345;

/// A point of a view with its normal, in the frame of the camera [m].
struct SurfacePoint {
  Eigen::Vector3d p, normal;
  double sigma = 0;  ///< Standard deviation of the depth [m].
};

Eigen::Vector3d point_at(const DenseView& view, int row, int col) {
  return view.camera.unproject(col, row, view.depth(row, col) * double{DenseView::kDepthUnit});
}

/// Returns the point of a pixel; none without a static surface around it.
std::optional<SurfacePoint> surface_point(const DenseView& view, int row, int col) {
  constexpr int r = kNormalReach;
  if (row < r || col < r || row + r >= view.depth.rows || col + r >= view.depth.cols)
    return std::nullopt;
  for (const auto& [d_row, d_col] : {std::pair{0, 0}, {-r, 0}, {r, 0}, {0, -r}, {0, r}}) {
    const bool usable = view.is_static(row + d_row, col + d_col);
    if (!usable || view.depth(row + d_row, col + d_col) == 0) return std::nullopt;
  }
  const Eigen::Vector3d p = point_at(view, row, col);
  const Eigen::Vector3d left = point_at(view, row, col - r), right = point_at(view, row, col + r);
  const Eigen::Vector3d above = point_at(view, row - r, col), below = point_at(view, row + r, col);
  const double bend = std::max((left + right - 2 * p).norm(), (above + below - 2 * p).norm());
  if (bend > kMaxBend * p.z()) return std::nullopt;
  const Eigen::Vector3d across = right - left, down = below - above;
  return SurfacePoint{p, down.cross(across).normalized(), view.camera.depth_sensor.sigma(p.z())};
}

std::vector<SurfacePoint> surface_points(const DenseView& view, int step) {
  std::vector<SurfacePoint> points;
  for (int row = 0; row < view.depth.rows; row += step) {
    for (int col = 0; col < view.depth.cols; col += step) {
      const auto point = surface_point(view, row, col);
      if (point && point->normal.allFinite()) points.push_back(*point);
    }
  }
  return points;
}

/// The surface of the registered views, world frame.
class Surface {
 public:
  struct Plane {
    Eigen::Vector3d point, normal;
  };

  void add(const DenseView& view, const Pose& T_world_camera) {
    for (const SurfacePoint& point : surface_points(view, kSurfaceStep)) {
      const Eigen::Vector3d p = T_world_camera * point.p;
      const auto voxel = voxel_at(p, kEdge);
      if (!voxel) continue;
      const std::uint32_t number = index_.add(*voxel);
      if (number == cells_.size()) cells_.emplace_back();
      cells_[number].points += p;
      cells_[number].normals += T_world_camera.quaternion() * point.normal;
      ++cells_[number].count;
    }
  }

  /// Returns the plane of the voxel at a point, or of the nearest one in front of or behind it up
  /// to one side away; none if there is none, or its surface is not flat.
  /// @param normal of the point, world frame
  std::optional<Plane> plane_near(const Eigen::Vector3d& p_world,
                                  const Eigen::Vector3d& normal) const {
    for (const double offset : {0.0, 0.5, -0.5, 1.0, -1.0}) {
      const auto voxel = voxel_at(p_world + offset * kEdge * normal, kEdge);
      const std::uint32_t number = voxel ? index_.find(*voxel) : VoxelIndex::kNone;
      if (number == VoxelIndex::kNone) continue;
      const Cell& cell = cells_[number];
      const double length = cell.normals.norm();
      if (length >= kFlat * cell.count)
        return Plane{cell.points / cell.count, cell.normals / length};
    }
    return std::nullopt;
  }

 private:
  struct Cell {
    Eigen::Vector3d points = Eigen::Vector3d::Zero(), normals = Eigen::Vector3d::Zero();
    int count = 0;
  };
  VoxelIndex index_;
  std::vector<Cell> cells_;
};

/// Returns the correction (v, w) of a pose in its camera frame, T_world_camera exp(v, w), by one
/// step of Gauss-Newton; none with too few points on the surface.
std::optional<Vector6d> correction(const Surface& surface, const std::vector<SurfacePoint>& points,
                                   const Pose& T_world_camera) {
  Matrix6d information = Matrix6d::Zero();
  information.diagonal() << Eigen::Vector3d::Constant(1 / (kShiftSigma * kShiftSigma)),
      Eigen::Vector3d::Constant(1 / (kTurnSigma * kTurnSigma));
  Vector6d gradient = Vector6d::Zero();
  const Eigen::Quaterniond q_camera_world = T_world_camera.quaternion().conjugate();
  int count = 0;
  for (const SurfacePoint& point : points) {
    const Eigen::Vector3d p_world = T_world_camera * point.p;
    const auto plane = surface.plane_near(p_world, T_world_camera.quaternion() * point.normal);
    if (!plane) continue;
    const Eigen::Vector3d n = q_camera_world * plane->normal;
    if (n.dot(point.normal) < kMinCosine) continue;
    // The mean of the voxel's points is not exact either, for which one more centimeter stands.
    constexpr double kPlaneSigma = 0.01;
    const double sigma = std::hypot(point.sigma, kPlaneSigma);
    const double residual = plane->normal.dot(p_world - plane->point);
    const double excess = std::abs(residual) / (kHuber * sigma);
    const double weight = (excess > 1 ? 1 / excess : 1) / (sigma * sigma);
    Vector6d J;
    J << n, point.p.cross(n);
    information += weight * J * J.transpose();
    gradient += weight * residual * J;
    ++count;
  }
  if (count < kMinPoints) return std::nullopt;
  return Vector6d(-information.ldlt().solve(gradient));
}

/// Returns the pose of a view on the surface; its own if there is no such pose nearby.
Pose pose_on(const Surface& surface, const PosedView& posed) {
  const auto points = surface_points(*posed.view, kPointStep);
  Pose T_world_camera = posed.T_world_camera;
  for (int i = 0; i < kIterations; ++i) {
    const auto step = correction(surface, points, T_world_camera);
    if (!step) return posed.T_world_camera;
    T_world_camera = T_world_camera * Pose::exp(*step);
    if (step->norm() < kConverged) break;
  }
  const Vector6d moved = (posed.T_world_camera.inverse() * T_world_camera).log();
  const bool nearby = moved.head<3>().norm() <= kMaxShift && moved.tail<3>().norm() <= kMaxTurn;
  return nearby ? T_world_camera : posed.T_world_camera;
}

}  // namespace

std::vector<PosedView> registered(std::vector<PosedView> views) {
  const TraceScope scope("registration");
  Surface surface;
  for (PosedView& posed : views) {
    posed.T_world_camera = pose_on(surface, posed);
    surface.add(*posed.view, posed.T_world_camera);
    posed.view->drop_pages();
  }
  return views;
}

}  // namespace stillmap
