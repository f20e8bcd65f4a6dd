// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <vector>

namespace stillmap {

/// Returns the most likely trajectory of a camera that moves smoothly, given poses that were
/// estimated frame by frame.
///
/// Prior: positions and rotations of constant velocity, disturbed by white noise on the
/// acceleration (Barfoot, State Estimation for Robotics, 2017, section 3.4.3), solved by the
/// Rauch-Tung-Striebel recursions (section 3.2.3). Measurements: the poses, with their covariances
/// times a common factor. The factor and the noise of the acceleration, of positions and of
/// rotations, are those of maximum likelihood of the innovations (Harvey, Forecasting, Structural
/// Time Series Models and the Kalman Filter, 1989, section 3.4); nothing is tuned to a camera.
///
/// Errors of the poses and accelerations both follow Student's t distribution: neither a single
/// wrong pose nor a jerk of the camera has much influence on its neighbors.
///
/// Rotations are smoothed as the sum of the rotation vectors from pose to pose, and the corrections
/// applied in the camera frame; valid for errors of a few degrees.
///
/// The covariance of a returned pose is that of the smoother, plus the part of the given covariance
/// that does not vary from frame to frame and that no smoothing reduces: the error of the map.
///
/// @param poses one uninterrupted path in one world, by increasing timestamps. Poses whose
///   covariance is zero take the median variances of the others. Fewer than ten poses, and poses
///   none of which has a covariance, are returned as they are.
std::vector<UncertainPose> smooth_trajectory(std::vector<UncertainPose> poses);

}  // namespace stillmap
