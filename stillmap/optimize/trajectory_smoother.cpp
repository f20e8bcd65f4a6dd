// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/trajectory_smoother.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/optimize/motion_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace stillmap {
namespace {

/// Least number of poses from which noise can be estimated.
constexpr std::size_t kMinPoses = 10;
/// Number of times that the weights of the measurements and accelerations are computed.
constexpr int kRounds = 12;
/// Logarithms of the noise at which the search for the maximum likelihood begins, their bounds, and
/// the first and the last step of the search.
constexpr double kFirstStep = 2, kLastStep = 0.2, kMaxLog = 16;
/// Poses from which the noise is estimated, in sections spread evenly over a longer path.
constexpr std::size_t kSection = 300, kMaxSections = 5;

/// Weights of one sample: they divide covariances.
struct Weights {
  double measurement = 1;
  Vector6d acceleration = Vector6d::Ones();  ///< Of the acceleration since the previous sample.
};

/// State of the filter at one sample.
struct Step {
  double dt = 0;  ///< Time since the previous sample [s].
  Estimate predicted, updated;
};

std::vector<std::span<const Sample>> sections_of(std::span<const Sample> samples) {
  const std::size_t count = std::min(kMaxSections, samples.size() / kSection);
  if (count < kMaxSections) return {samples};
  std::vector<std::span<const Sample>> sections;
  for (std::size_t i = 0; i < count; ++i)
    sections.push_back(samples.subspan(i * (samples.size() - kSection) / (count - 1), kSection));
  return sections;
}

/// Returns the most likely noise: of the factor and of the accelerations of positions and
/// rotations, one logarithm at a time.
Noise estimated_noise(std::span<const Sample> samples) {
  using Logs = std::array<double, 3>;
  const auto sections = sections_of(samples);
  const auto likelihood_of = [&](const Logs& logs) {
    double sum = 0;
    for (const auto& section : sections)
      sum += filter_forward(section, noise_of(logs)).log_likelihood;
    return sum;
  };
  Logs best = {0, 0, 0}, step = {kFirstStep, kFirstStep, kFirstStep};
  double most = likelihood_of(best);
  while (*std::max_element(step.begin(), step.end()) > kLastStep) {
    for (std::size_t i = 0; i < best.size(); ++i) {
      bool moved = false;
      for (const double sign : {1.0, -1.0}) {
        Logs trial = best;
        trial[i] = std::clamp(trial[i] + sign * step[i], -kMaxLog, kMaxLog);
        const double likelihood = likelihood_of(trial);
        if (!(likelihood > most)) continue;
        most = likelihood, best = trial, moved = true;
        break;
      }
      if (!moved) step[i] /= 2;
    }
  }
  return noise_of(best);
}

std::vector<Step> filtered(std::span<const Sample> samples, const Noise& noise,
                           const std::vector<Weights>& weights) {
  std::vector<Step> steps(samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    Step& step = steps[k];
    if (k == 0) {
      step.predicted = initial_estimate(samples[0], noise.factor);
    } else {
      step.dt = samples[k].timestamp - samples[k - 1].timestamp;
      step.predicted = predict(steps[k - 1].updated, step.dt,
                               noise.acceleration.cwiseQuotient(weights[k].acceleration));
    }
    step.updated = update(step.predicted, samples[k].value - step.predicted.x.head<6>(),
                          noise.factor / weights[k].measurement * samples[k].covariance);
  }
  return steps;
}

/// Backward recursion of Rauch, Tung and Striebel.
std::vector<Estimate> smoothed(const std::vector<Step>& steps) {
  std::vector<Estimate> estimates(steps.size());
  estimates.back() = steps.back().updated;
  for (std::size_t k = steps.size() - 1; k-- > 0;) {
    const Estimate &now = steps[k].updated, &next = steps[k + 1].predicted;
    Matrix12d FP = now.P;
    FP.topRows<6>() += steps[k + 1].dt * now.P.bottomRows<6>();
    const Matrix12d gain = next.P.ldlt().solve(FP).transpose();
    estimates[k].x = now.x + gain * (estimates[k + 1].x - next.x);
    estimates[k].P = now.P + gain * (estimates[k + 1].P - next.P) * gain.transpose();
  }
  return estimates;
}

double measurement_weight(const Sample& sample, const Estimate& estimate, double factor) {
  const Vector6d e = estimate.x.head<6>() - sample.value;
  return student_weight(e.dot(sample.covariance.llt().solve(e)) / factor);
}

/// Weights of the acceleration between two samples, of positions and of rotations separately, since
/// a hand jerks in either.
Vector6d acceleration_weights(const Estimate& from, const Estimate& to, double dt,
                              const Vector6d& density) {
  const Vector6d position = to.x.head<6>() - from.x.head<6>() - dt * from.x.tail<6>();
  const Vector6d velocity = to.x.tail<6>() - from.x.tail<6>();
  // The inverse of the covariance of white noise integrated once and twice.
  const Vector6d chi2 =
      (12 / (dt * dt * dt) * position.cwiseAbs2() -
       12 / (dt * dt) * position.cwiseProduct(velocity) + 4 / dt * velocity.cwiseAbs2())
          .cwiseQuotient(density);
  Vector6d weights;
  weights.head<3>().setConstant(student_weight(chi2.head<3>().sum()));
  weights.tail<3>().setConstant(student_weight(chi2.tail<3>().sum()));
  return weights;
}

std::vector<Estimate> most_likely(std::span<const Sample> samples, const Noise& noise) {
  std::vector<Weights> weights(samples.size());
  std::vector<Estimate> estimates;
  for (int round = 0; round < kRounds; ++round) {
    estimates = smoothed(filtered(samples, noise, weights));
    for (std::size_t k = 0; k < samples.size(); ++k) {
      weights[k].measurement = measurement_weight(samples[k], estimates[k], noise.factor);
      if (k == 0) continue;
      weights[k].acceleration =
          acceleration_weights(estimates[k - 1], estimates[k],
                               samples[k].timestamp - samples[k - 1].timestamp, noise.acceleration);
    }
  }
  return estimates;
}

/// Returns the median variances of the poses that have a covariance; zero if there is none.
Matrix6d typical_covariance(const std::vector<UncertainPose>& poses) {
  Matrix6d typical = Matrix6d::Zero();
  for (Eigen::Index i = 0; i < 6; ++i) {
    std::vector<double> variances;
    for (const UncertainPose& pose : poses)
      if (pose.covariance(i, i) > 0) variances.push_back(pose.covariance(i, i));
    if (!variances.empty()) typical(i, i) = upper_median(variances);
  }
  return typical;
}

}  // namespace

std::vector<UncertainPose> smooth_trajectory(std::vector<UncertainPose> poses) {
  const Matrix6d typical = typical_covariance(poses);
  for (UncertainPose& pose : poses)
    if (!(pose.covariance.trace() > 0)) pose.covariance = typical;
  if (poses.size() < kMinPoses || !(typical.trace() > 0)) return poses;

  const std::vector<Sample> samples = samples_of(poses);
  const Noise noise = estimated_noise(samples);
  const std::vector<Estimate> estimates = most_likely(samples, noise);
  const double slow = std::max(0.0, 1 - noise.factor);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector6d correction = estimates[k].x.head<6>() - samples[k].value;
    const Matrix6d J = to_world(poses[k].T_world_camera);
    poses[k].T_world_camera = corrected(poses[k].T_world_camera, correction);
    poses[k].covariance =
        (slow * poses[k].covariance + J.transpose() * estimates[k].P.topLeftCorner<6, 6>() * J)
            .eval();
  }
  return poses;
}

}  // namespace stillmap
