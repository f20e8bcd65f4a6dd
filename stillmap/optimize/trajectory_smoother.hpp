// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

namespace stillmap {

/// Returns the most likely trajectory of a camera that moves smoothly, given poses that were
/// estimated frame by frame and err independently: positions and rotations are smoothed with the
/// prior of a constant velocity disturbed by white noise on the acceleration (Barfoot, State
/// Estimation for Robotics, 2017, section 3.4.3, solved by the Rauch-Tung-Striebel recursions,
/// section 3.2.3).
///
/// The noise of the poses and of the acceleration are estimated from the trajectory itself, by
/// maximum likelihood of the innovations (Harvey, Forecasting, Structural Time Series Models and
/// the Kalman Filter, 1989, section 3.4); nothing is tuned to a camera. Errors of the poses are
/// taken to follow Student's t distribution, so that a single wrong pose has little influence.
///
/// Rotations are smoothed as the sum of the rotation vectors from pose to pose, and the corrections
/// applied in the camera frame; valid for errors of a few degrees.
///
/// @param poses one uninterrupted path in one world, by increasing timestamps. Fewer than ten poses
///   are returned as they are.
Trajectory smooth_trajectory(const Trajectory& poses);

}  // namespace stillmap
