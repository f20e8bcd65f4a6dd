// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/optimize/residual.hpp"

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

/// Model of a camera that moves smoothly, for the smoother and the filter of its trajectory:
/// internal to the module.
///
/// Positions and rotations have constant velocity, disturbed by white noise on the acceleration
/// (Barfoot, State Estimation for Robotics, 2017, section 3.4.3). Rotations are the sum of the
/// rotation vectors from pose to pose.
namespace stillmap {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// A measured position [m] and rotation vector [rad].
struct Sample {
  double timestamp = 0;
  Vector6d value = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
};

/// Noise of a path.
struct Noise {
  double factor = 1;                         ///< Of the covariances of the measurements.
  Vector6d acceleration = Vector6d::Ones();  ///< Spectral densities [m^2/s^3, rad^2/s^3].
};

/// Returns noise from the logarithms of its factor and of the spectral densities of positions and
/// of rotations.
Noise noise_of(const std::array<double, 3>& logs);

/// Positions with rotations, then velocities; with their covariance.
struct Estimate {
  Vector12d x = Vector12d::Zero();
  Matrix12d P = Matrix12d::Zero();
};

/// Returns positions and rotation vectors of poses, with covariances in the world frame.
std::vector<Sample> samples_of(std::span<const UncertainPose> poses);

/// Returns a pose moved by a correction (position in the world, rotation vector).
Pose corrected(const Pose& T_world_camera, const Vector6d& correction);

/// Derivative of (position in the world, rotation vector) by a perturbation in the camera frame.
Matrix6d to_world(const Pose& T_world_camera);

Estimate initial_estimate(const Sample& first, double factor);

/// Constant velocity for `dt` [s], with accelerations of spectral density `density`.
Estimate predict(const Estimate& from, double dt, const Vector6d& density);

Estimate update(const Estimate& predicted, const Vector6d& innovation, const Matrix6d& R);

/// Degrees of freedom of Student's t distribution of errors and accelerations: heavy tails with
/// finite variance (Lange, Little, Taylor, JASA 1989).
inline constexpr double kFreedom = 4;

/// Weight of a six-dimensional vector whose squared length, over its variance, is `chi2`.
inline double student_weight(double chi2) { return (kFreedom + 6) / (kFreedom + chi2); }

/// End of a path that was filtered forward.
struct FilteredEnd {
  Estimate estimate;          ///< of the last sample
  double log_likelihood = 0;  ///< of the innovations
};

/// Explanation of improbable samples.
enum class Improbable {
  kMeasurement,   ///< Each is a wrong measurement.
  kThenVelocity,  ///< One is a wrong measurement; from the next on, the velocity has changed.
};

/// Filters a path of at least one sample.
FilteredEnd filter_forward(std::span<const Sample> samples, const Noise& noise,
                           Improbable improbable = Improbable::kMeasurement);

}  // namespace stillmap
