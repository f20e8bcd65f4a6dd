// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/optimize/residual.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Observation of a landmark by the camera to be localized.
struct PoseObservation {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< Landmark position in the world frame [m].
  float u = 0, v = 0;                                 ///< Keypoint position [pixels].
  float depth = 0;  ///< Depth along the optical axis [m]; 0 or not finite: unknown.
  float scale = 1;  ///< Scale of the keypoint's pyramid level, scale_factor^level.
  /// Probability of being static [0..1], multiplies the information; 0: ignored.
  float weight = 1;
};

/// What is known of a pose before its observations, such as from the previous pose and the motion
/// that an IMU or wheels measured since.
struct PosePrior {
  Pose T_world_camera;
  /// Inverse covariance of the perturbation (v, w) in T_world_camera exp(v, w) [1/m^2, 1/rad^2]; 0
  /// for what is not known.
  Matrix6d information = Matrix6d::Zero();

  /// Returns the squared distance of a pose [sigma^2].
  double chi2(const Pose& T_world_other) const {
    const Vector6d difference = (T_world_camera.inverse() * T_world_other).log();
    return difference.dot(information * difference);
  }
};

struct PoseSolution {
  Pose T_world_camera;  ///< The initial guess if there is no solution.
  /// One per observation: the pixel is an inlier. Unusable observations (weight 0, not finite) are
  /// never inliers.
  std::vector<std::uint8_t> inlier;
  /// One per observation: an inlier whose depth is an inlier too. At depth edges only the pixel may
  /// be one.
  std::vector<std::uint8_t> depth_inlier;
  int inliers = 0, depth_inliers = 0;
  /// Root mean square residual of the inliers' components [sigmas]; 1 is expected.
  double rms = 0;
  int iterations = 0;  ///< Number of linear systems solved in all rounds.
  /// Inverse covariance of the left perturbation xi = (v, w) in T_camera_world' = exp(xi)
  /// T_camera_world, from the inliers and the prior [1/m^2, 1/rad^2].
  Matrix6d information = Matrix6d::Zero();
  /// True if there are enough inliers and they constrain all six degrees of freedom. Otherwise the
  /// pose must not be used.
  bool well_posed = false;
};

/// Estimates the pose of one camera from known landmarks: Levenberg-Marquardt on the residuals of
/// residual.hpp. Pixel and disparity have separate robust kernels and inlier tests, so a wrong
/// depth does not discard the pixel; a wrong pixel discards its depth, which belongs to another
/// point. Never throws; unsolvable input returns the guess, not well posed. Deterministic and
/// single-threaded.
PoseSolution solve_pose(const Camera& camera, const Pose& T_world_camera_guess,
                        std::span<const PoseObservation> observations,
                        const std::optional<PosePrior>& prior = std::nullopt);

}  // namespace stillmap
