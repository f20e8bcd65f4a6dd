// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/observation_noise.hpp"
#include "stillmap/geometry/pose.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

/// Observation model of the pose solver and bundle adjustment.
///
/// An RGB-D keypoint is a pixel (u, v) and, where depth is known, a disparity d = bf / depth: the
/// disparity d = u - u_r that a virtual second camera one baseline to the right would measure. The
/// residual is (u, v, d) and not (u, v, u_r), although both carry the same information: the corner
/// detector errs in u and v, the depth sensor in d, and these errors are independent. So (u, v, d)
/// has a diagonal covariance, whereas u_r = u - d would inherit the error of u and need a full one.
/// Each part can also be rejected separately: at a depth edge the pixel is good and the depth is
/// not.
///
/// A triangulating sensor measures disparity with constant noise, that is depth with sigma_z = m
/// z^2 (Khoshelham and Elberink, Sensors 2012, eq. 10), so sigma_d = bf m is independent of depth
/// and pyramid level; that of other sensors depends on depth: observation_noise(). The pixel error
/// grows with the scale of the level.
namespace stillmap {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

/// Inlier bounds of pixel and disparity residuals: 95 % quantiles of the chi-square distribution
/// with 2 and 1 degrees of freedom.
inline constexpr double kPixelChi2 = 5.991;
inline constexpr double kDisparityChi2 = 3.841;

/// Points nearer than this to the camera plane count as behind the camera [m].
inline constexpr double kNearPlane = 0.05;

/// A keypoint measurement for the solvers.
struct Measurement {
  /// Pixel and disparity [pixels]; disparity 0 without depth.
  Eigen::Vector3d uvd = Eigen::Vector3d::Zero();
  double pixel_information = 0;      ///< Information 1 / sigma^2; 0 for an unusable keypoint.
  double disparity_information = 0;  ///< Information 1 / sigma^2; 0 without depth.

  bool usable() const { return pixel_information > 0; }
  bool has_depth() const { return disparity_information > 0; }
};

/// @param u, v  pixel
/// @param depth meters; zero, negative or not finite: none
/// @param scale the pyramid level's scale, scale_factor^level >= 1, by which the pixel sigma grows
/// A pixel or scale that is not finite, or a scale <= 0, gives an unusable measurement.
Measurement make_measurement(const Camera& camera, const ObservationNoise& noise, double u,
                             double v, double depth, double scale);

/// Returns whether a landmark position is usable: finite and within 1000 km of the origin.
inline bool is_plausible_point(const Eigen::Vector3d& p_world) {
  return p_world.squaredNorm() < 1e12;  // Also false for NaN.
}

/// Returns (u, v, d) of a point with p_camera.z > 0.
inline Eigen::Vector3d predict(const Camera& camera, const Eigen::Vector3d& p_camera) {
  const double iz = 1.0 / p_camera.z();
  return {camera.fx * p_camera.x() * iz + camera.cx, camera.fy * p_camera.y() * iz + camera.cy,
          camera.bf() * iz};
}

/// d(u, v, d) / d(p_camera).
inline Eigen::Matrix3d projection_jacobian(const Camera& camera, const Eigen::Vector3d& p_camera) {
  const double iz = 1.0 / p_camera.z(), iz2 = iz * iz;
  Eigen::Matrix3d J;
  J << camera.fx * iz, 0, -camera.fx * p_camera.x() * iz2,  //
      0, camera.fy * iz, -camera.fy * p_camera.y() * iz2,   //
      0, 0, -camera.bf() * iz2;
  return J;
}

/// d(u, v, d) / d(xi), translation first, for the left perturbation T_camera_world' = exp(xi)
/// T_camera_world: p_camera' = p_camera + v + w x p_camera to first order. `J_projection` as from
/// projection_jacobian().
inline Matrix36d pose_jacobian(const Eigen::Matrix3d& J_projection,
                               const Eigen::Vector3d& p_camera) {
  Matrix36d J;
  J.leftCols<3>() = J_projection;
  // Row by row, a . (w x p) = w . (p x a).
  for (int row = 0; row < 3; ++row) {
    const Eigen::Vector3d a = J_projection.row(row);
    J.block<1, 3>(row, 3) = p_camera.cross(a).transpose();
  }
  return J;
}

/// d(u, v, d) / d(p_world).
inline Eigen::Matrix3d point_jacobian(const Eigen::Matrix3d& J_projection,
                                      const Eigen::Matrix3d& R_camera_world) {
  return J_projection * R_camera_world;
}

/// Squared residuals of pixel and disparity [sigma^2]; the latter is 0 without depth.
struct Chi2 {
  double pixel = 0, disparity = 0;
};

inline Chi2 chi2(const Measurement& m, const Eigen::Vector3d& predicted) {
  const Eigen::Vector3d e = predicted - m.uvd;
  return {m.pixel_information * (e.x() * e.x() + e.y() * e.y()),
          m.disparity_information * e.z() * e.z()};
}

/// Huber kernel on a squared residual s (Huber 1964): rho(s) = s inside and 2 k sqrt(s) - k^2
/// outside the bound s = k^2.
struct HuberKernel {
  double bound = 1;  ///< Bound k^2 [sigma^2].
  double rho(double s) const { return s <= bound ? s : 2 * std::sqrt(bound * s) - bound; }
  /// Returns rho'(s), the factor of the residual's information.
  double weight(double s) const { return s <= bound ? 1 : std::sqrt(bound / s); }
};

}  // namespace stillmap
