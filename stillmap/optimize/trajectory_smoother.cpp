// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/trajectory_smoother.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/LU>

namespace stillmap {
namespace {

/// Least number of poses from which noise can be estimated.
constexpr std::size_t kMinPoses = 10;
/// Degrees of freedom of Student's t distribution of the errors: heavy tails with finite variance
/// (Lange, Little, Taylor, JASA 1989).
constexpr double kFreedom = 4;
/// Median of a chi-square distribution with three degrees of freedom.
constexpr double kMedianChi2 = 2.366;
/// Variance of the first velocity, relative to that of a measurement [1/s^2]: unknown.
constexpr double kInitialVelocity = 1e6;
/// Candidates for the ratio of the spectral density of the acceleration to the variance of a
/// measurement [1/s^3]: from a camera at rest to one without noise.
constexpr double kMinRatio = 1e1, kMaxRatio = 1e9, kRatioStep = 2;
/// Number of times that the weights of the measurements are computed again.
constexpr int kRounds = 4;

/// Values and velocities, one column per axis.
using State = Eigen::Matrix<double, 2, 3>;

/// A measured vector at a time.
struct Sample {
  double timestamp = 0;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
};

/// State of the filter at one sample; the three axes share a covariance.
struct Step {
  State predicted, x;
  Eigen::Matrix2d P_predicted, P;
  Eigen::Matrix2d F = Eigen::Matrix2d::Identity();
  double innovation2 = 0;  ///< Squared innovation over its variance.
};

Eigen::Matrix2d transition(double dt) {
  Eigen::Matrix2d F;
  F << 1, dt, 0, 1;
  return F;
}

Eigen::Matrix2d process_noise(double dt, double density) {
  Eigen::Matrix2d Q;
  Q << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt;
  return density * Q;
}

/// Weight of a measurement whose squared residual, over its variance, is `chi2`.
double student_weight(double chi2) { return (kFreedom + 3) / (kFreedom + chi2); }

/// Kalman filter with measurements of unit variance.
/// @param ratio   density of the acceleration, relative to the variance of a measurement [1/s^3]
/// @param weights one per sample, divide the variance; empty: weights from the innovations, scaled
///   by `variance`
std::vector<Step> filtered(const std::vector<Sample>& samples, double ratio,
                           const std::vector<double>& weights, double variance) {
  std::vector<Step> steps(samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    Step& step = steps[k];
    if (k == 0) {
      step.predicted.setZero();
      step.predicted.row(0) = samples[0].value.transpose();
      step.P_predicted << 1, 0, 0, kInitialVelocity;
    } else {
      const double dt = samples[k].timestamp - samples[k - 1].timestamp;
      step.F = transition(dt);
      step.predicted = step.F * steps[k - 1].x;
      step.P_predicted = step.F * steps[k - 1].P * step.F.transpose() + process_noise(dt, ratio);
    }
    const Eigen::RowVector3d innovation = samples[k].value.transpose() - step.predicted.row(0);
    const double S = step.P_predicted(0, 0) + 1;
    step.innovation2 = innovation.squaredNorm() / S;
    const double weight =
        weights.empty() ? std::min(1.0, student_weight(step.innovation2 / variance)) : weights[k];
    const Eigen::Vector2d K = step.P_predicted.col(0) / (step.P_predicted(0, 0) + 1 / weight);
    step.x = step.predicted + K * innovation;
    step.P = step.P_predicted - K * step.P_predicted.row(0);
  }
  return steps;
}

/// Noise of a sequence of samples.
struct Noise {
  double ratio = 0;     ///< Density of the acceleration over the variance [1/s^3].
  double variance = 1;  ///< Of a measurement, in squared units of the samples.
};

/// Variance of the measurements that the median of the innovations shows.
double variance_of(const std::vector<Step>& steps) {
  std::vector<double> squares;
  for (std::size_t k = 2; k < steps.size(); ++k) squares.push_back(steps[k].innovation2);
  return std::max(upper_median(squares) / kMedianChi2, std::numeric_limits<double>::min());
}

double log_likelihood(const std::vector<Step>& steps, double variance) {
  double sum = 0;
  for (std::size_t k = 2; k < steps.size(); ++k) {
    sum -= 1.5 * std::log(variance * (steps[k].P_predicted(0, 0) + 1)) +
           0.5 * (kFreedom + 3) * std::log1p(steps[k].innovation2 / variance / kFreedom);
  }
  return sum;
}

/// Returns the most likely noise.
Noise estimated_noise(const std::vector<Sample>& samples) {
  Noise best;
  double most = -std::numeric_limits<double>::infinity();
  const std::vector<double> equal(samples.size(), 1);
  for (double ratio = kMinRatio; ratio <= kMaxRatio; ratio *= kRatioStep) {
    const double first = variance_of(filtered(samples, ratio, equal, 1));
    const std::vector<Step> steps = filtered(samples, ratio, {}, first);
    const double variance = variance_of(steps);
    const double likelihood = log_likelihood(steps, variance);
    if (likelihood <= most) continue;
    most = likelihood;
    best = {ratio, variance};
  }
  return best;
}

/// Backward recursion of Rauch, Tung and Striebel. Returns the smoothed values.
std::vector<Eigen::Vector3d> smoothed_values(const std::vector<Step>& steps) {
  std::vector<Eigen::Vector3d> values(steps.size());
  State x = steps.back().x;
  values.back() = x.row(0).transpose();
  for (std::size_t k = steps.size() - 1; k-- > 0;) {
    const Step &now = steps[k], &next = steps[k + 1];
    const Eigen::Matrix2d gain = now.P * next.F.transpose() * next.P_predicted.inverse();
    x = now.x + gain * (x - next.predicted);
    values[k] = x.row(0).transpose();
  }
  return values;
}

/// Returns the corrections that make the samples smooth.
std::vector<Eigen::Vector3d> smoothing_corrections(const std::vector<Sample>& samples) {
  const Noise noise = estimated_noise(samples);
  std::vector<double> weights(samples.size(), 1);
  std::vector<Eigen::Vector3d> corrections(samples.size());
  for (int round = 0; round < kRounds; ++round) {
    const auto values = smoothed_values(filtered(samples, noise.ratio, weights, noise.variance));
    for (std::size_t k = 0; k < samples.size(); ++k) {
      corrections[k] = values[k] - samples[k].value;
      weights[k] = std::min(1.0, student_weight(corrections[k].squaredNorm() / noise.variance));
    }
  }
  return corrections;
}

std::vector<Sample> positions_of(const Trajectory& poses) {
  std::vector<Sample> samples;
  for (const StampedPose& pose : poses)
    samples.push_back({pose.timestamp, pose.T_world_camera.translation()});
  return samples;
}

/// Returns the sums of the rotation vectors from pose to pose.
std::vector<Sample> rotations_of(const Trajectory& poses) {
  std::vector<Sample> samples{{poses.front().timestamp, Eigen::Vector3d::Zero()}};
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const Eigen::Quaterniond turned =
        poses[k - 1].T_world_camera.quaternion().conjugate() * poses[k].T_world_camera.quaternion();
    samples.push_back({poses[k].timestamp, samples.back().value + so3_log(turned)});
  }
  return samples;
}

}  // namespace

Trajectory smooth_trajectory(const Trajectory& poses) {
  if (poses.size() < kMinPoses) return poses;
  const auto translation = smoothing_corrections(positions_of(poses));
  const auto rotation = smoothing_corrections(rotations_of(poses));
  Trajectory smooth = poses;
  for (std::size_t k = 0; k < smooth.size(); ++k) {
    Pose& T = smooth[k].T_world_camera;
    T = Pose(T.quaternion() * so3_exp(rotation[k]), T.translation() + translation[k]);
  }
  return smooth;
}

}  // namespace stillmap
