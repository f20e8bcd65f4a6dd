// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/bundle_adjustment.hpp"
#include "stillmap/optimize/residual.hpp"

#include <cstddef>

namespace stillmap {

/// Indices of the calibrated parameters: focal lengths and principal point [pixels], disparity
/// offset and bow [1/m] (DisparityBias), and the slopes of the disparity error over the columns and
/// rows of the image, in the corners [1/m].
enum CameraParameter {
  kFx,
  kFy,
  kCx,
  kCy,
  kDisparityOffset,
  kDisparityBow,
  kDisparitySlopeX,
  kDisparitySlopeY
};
inline constexpr int kCameraParameters = 8;
using CameraVector = Eigen::Matrix<double, kCameraParameters, 1>;

/// Errors of a camera's parameters, estimated from a map.
struct CameraCalibration {
  /// Estimated minus given value of each parameter.
  CameraVector correction = CameraVector::Zero();
  /// Standard deviation of each correction.
  CameraVector sigma = CameraVector::Zero();
  std::size_t observations = 0;  ///< Number of observations in use.
  /// Mean squared residual of the observations with the given and with the corrected camera [1]; 1
  /// is expected.
  double variance_before = 1, variance_after = 1;
};

/// Source of the variance factor for errors that are correlated between frames.
enum class AlikeErrors {
  kAssumed,   ///< A fixed factor, sufficient to detect gross errors of the camera.
  kMeasured,  ///< Also times the ratio of jackknife to Hessian, if above 1.
};

/// Estimates the errors of a camera's intrinsics and of its depth by bundle adjustment in which
/// they are variables, too. Landmarks are eliminated by the Schur complement, and the parameters
/// are the last block of the reduced system. A uniform scale of the depth cannot be observed: it is
/// that of the map. An error of the disparity is found where triangulation and depth disagree
/// differently at different depths.
///
/// Errors of observations are not independent: the errors of a landmark persist over many frames.
/// The information of the observations is therefore divided by a variance factor. This enlarges the
/// standard deviations and gives the prior (the usual errors of sensors) its proper weight. A
/// standard deviation is the larger of two: from the inverse of the reduced Hessian, scaled by the
/// variance of the residuals, and from the jackknife over groups of consecutive poses (Efron and
/// Stein, The Jackknife Estimate of Variance, 1981). A parameter without information keeps the
/// standard deviation of the prior.
///
/// @param problem poses in temporal order; pose_fixed and point_fixed are not used: the pose with
///                most observations is fixed, since the cost does not depend on the world frame
/// Throws Error as adjust_bundle().
CameraCalibration calibrate_camera(const BundleProblem& problem,
                                   AlikeErrors alike = AlikeErrors::kMeasured);

/// Returns whether a correction shows for certain that an intrinsic parameter is wrong: more than 4
/// % of the focal length and 3 standard deviations.
/// @param correction, sigma, focal_length  [pixels]
bool is_wrong_intrinsic(double correction, double sigma, double focal_length);

/// Returns is_wrong_intrinsic() of a focal length, kFx or kFy.
bool is_wrong_focal_length(const Camera& given, const CameraCalibration& found,
                           CameraParameter focal);

/// Returns whether the depths grow toward the corners of the image as distances from the camera do
/// in place of depths along its optical axis: a bow of less than -0.03 1/m (6 % of a depth of 2 m)
/// and 3 standard deviations. Runs on recordings of two sensors gave -0.01 and 0.03 1/m, and -0.04
/// to -0.26 1/m with distances.
bool shows_distances(const CameraCalibration& found);

}  // namespace stillmap
