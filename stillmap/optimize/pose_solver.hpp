// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/optimize/residual.hpp"

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// A landmark seen by the camera whose pose is sought.
struct PoseObservation {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< the landmark [m]
  float u = 0, v = 0;                                 ///< where it is seen [pixels]
  float depth = 0;  ///< along the optical axis [m]; 0 or not finite: none
  float scale = 1;  ///< of the keypoint's pyramid level, scale_factor^level
  float weight =
      1;  ///< probability of standing still, 0 to 1, multiplies the information; 0: ignored
};

struct PoseSolverOptions {
  ObservationNoise noise{};
  int robust_rounds = 2;  ///< rounds with Huber's kernel; after each, inliers are chosen anew
  int plain_rounds = 2;   ///< then rounds of plain least squares on the inliers
  int iterations = 10;    ///< at most, per round
  /// A round ends when a step |(v, w)| falls below it [m, rad]; a robust round at ten times as
  /// much, for it need only tell inliers from outliers. What is left then is of the order of the
  /// step squared.
  double step_tolerance = 1e-5;
  double pixel_chi2 = kPixelChi2;          ///< inlier bound of the pixel part [sigma^2]
  double disparity_chi2 = kDisparityChi2;  ///< inlier bound of the disparity part [sigma^2]
  int min_inliers = 6;                     ///< fewer: not well posed
  double max_translation_sigma = 0.1;      ///< worst direction, predicted; more: not well posed [m]
  double max_rotation_sigma = 0.05;        ///< worst axis, predicted; more: not well posed [rad]
  STILLMAP_FIELDS(noise, robust_rounds, plain_rounds, iterations, step_tolerance, pixel_chi2,
                  disparity_chi2, min_inliers, max_translation_sigma, max_rotation_sigma)
};

struct PoseSolution {
  Pose T_world_camera;  ///< the guess where nothing could be solved
  /// One per observation: the pixel agrees. Unusable observations (weight 0, not finite) are never
  /// inliers.
  std::vector<std::uint8_t> inlier;
  /// One per observation: an inlier with depth whose depth agrees too. An inlier at a depth edge
  /// may lack it.
  std::vector<std::uint8_t> depth_inlier;
  int inliers = 0, depth_inliers = 0;
  double rms = 0;  ///< root mean square residual of the inliers' components [sigmas]; 1 is expected
  int iterations = 0;  ///< linear systems solved, all rounds together
  /// Inverse covariance of the left perturbation xi = (v, w) in T_camera_world' = exp(xi)
  /// T_camera_world, from the inliers [1/m^2, 1/rad^2].
  Matrix6d information = Matrix6d::Zero();
  /// Enough inliers, and no direction of motion that they leave open. If false, do not trust the
  /// pose.
  bool well_posed = false;
};

/// Pose of one camera from landmarks at known places: Levenberg-Marquardt on the residuals of
/// residual.hpp, pixel and disparity each with a robust kernel and an inlier test of its own, so
/// that a wrong depth does not cost the pixel. A wrong pixel does cost its depth: it is another
/// thing's. Never throws; hopeless input comes back as the guess, not well posed. Deterministic,
/// single-threaded.
PoseSolution solve_pose(const Camera& camera, const Pose& T_world_camera_guess,
                        std::span<const PoseObservation> observations,
                        const PoseSolverOptions& options = {});

}  // namespace stillmap
