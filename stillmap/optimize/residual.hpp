// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

/// The observation model that the pose solver and bundle adjustment share.
///
/// An RGB-D keypoint is a pixel (u, v) and, where depth is known, a disparity d = bf / depth: what
/// a second, virtual camera one baseline to the right would have measured as d = u - u_r. The
/// residual is kept as (u, v, d) and not as (u, v, u_r), although both hold the same information:
/// the corner detector errs in u and v, the depth sensor in d, and they err independently. So (u,
/// v, d) has a diagonal covariance, whereas u_r = u - d would inherit the error of u and need a
/// full one. It also lets each part be judged by itself: at a depth edge the pixel is good and the
/// depth is not.
///
/// Structured light measures disparity with constant noise, that is depth with sigma_z = m * z^2
/// (Khoshelham and Elberink, Sensors 2012, eq. 10; m = 1.4e-3 / m for the Kinect), so sigma_d
/// = bf m is a constant of the sensor, independent of depth and of the pyramid level. The pixel
/// error grows with the level's scale.
namespace stillmap {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

/// 95 % quantiles of the chi-square distribution with 2 and 1 degrees of freedom: the bounds
/// between inlier and outlier for the pixel and the disparity part.
inline constexpr double kPixelChi2 = 5.991;
inline constexpr double kDisparityChi2 = 3.841;

/// Points nearer than this to the camera plane count as behind the camera [m].
inline constexpr double kNearPlane = 0.05;

/// How precisely a keypoint is measured.
struct ObservationNoise {
  double pixel_sigma = 1.0;  ///< of u and of v, of a keypoint at pyramid level 0 [pixels]
  /// Of bf / depth, at any level [pixels]. 0.06 is the Kinect's own; the rest is for depth and
  /// color that do not lie exactly on each other.
  double disparity_sigma = 0.3;
  STILLMAP_FIELDS(pixel_sigma, disparity_sigma)
};

/// One keypoint as the solvers see it.
struct Measurement {
  /// Pixel and disparity; disparity 0 without depth.
  Eigen::Vector3d uvd = Eigen::Vector3d::Zero();
  double pixel_information = 0;      ///< 1 / sigma^2; 0 for an unusable keypoint
  double disparity_information = 0;  ///< 1 / sigma^2; 0 without depth

  bool usable() const { return pixel_information > 0; }
  bool has_depth() const { return disparity_information > 0; }
};

/// @param u, v  pixel
/// @param depth meters; zero, negative or not finite: none
/// @param scale the pyramid level's scale, scale_factor^level >= 1, by which the pixel sigma grows
/// A pixel or scale that is not finite, or a scale <= 0, gives an unusable measurement.
Measurement make_measurement(const Camera& camera, const ObservationNoise& noise, double u,
                             double v, double depth, double scale);

/// Whether a landmark can be used: finite, and nearer to the origin than 1000 km.
inline bool is_plausible_point(const Eigen::Vector3d& p_world) {
  return p_world.squaredNorm() < 1e12;  // false for NaN too
}

/// (u, v, d) of a point with p_camera.z > 0.
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

/// Squared residuals in units of their variances: of the pixel, and of the disparity (0 without
/// depth).
struct Chi2 {
  double pixel = 0, disparity = 0;
};

inline Chi2 chi2(const Measurement& m, const Eigen::Vector3d& predicted) {
  const Eigen::Vector3d e = predicted - m.uvd;
  return {m.pixel_information * (e.x() * e.x() + e.y() * e.y()),
          m.disparity_information * e.z() * e.z()};
}

/// Huber's kernel on a squared residual s (Huber 1964), as in rho(s) = s inside, 2 k sqrt(s) - k^2
/// outside the bound s = k^2.
struct HuberKernel {
  double bound = 1;  ///< k^2
  double rho(double s) const { return s <= bound ? s : 2 * std::sqrt(bound * s) - bound; }
  /// rho'(s): the factor by which the information of the residual shrinks.
  double weight(double s) const { return s <= bound ? 1 : std::sqrt(bound / s); }
};

}  // namespace stillmap
