// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/motion_model.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

/// Standard deviations of the first velocity: unknown [m/s, rad/s].
constexpr double kInitialVelocity = 1;
/// Squared length from which an innovation is improbable: the 99.9 % quantile of the chi-square
/// distribution with six degrees of freedom.
constexpr double kImprobableChi2 = 22.458;

/// A sample compared with its prediction.
struct Innovation {
  Estimate predicted;
  Vector6d difference;
  double chi2, log_determinant;

  Innovation(Estimate prediction, const Sample& sample, const Matrix6d& R)
      : predicted(std::move(prediction)), difference(sample.value - predicted.x.head<6>()) {
    const Eigen::LLT<Matrix6d> S(predicted.P.topLeftCorner<6, 6>() + R);
    chi2 = difference.dot(S.solve(difference));
    log_determinant = 2 * S.matrixLLT().diagonal().array().log().sum();
  }
  double log_likelihood() const {
    return -0.5 * log_determinant - 0.5 * (kFreedom + 6) * std::log1p(chi2 / kFreedom);
  }
};

/// Sets the velocity to unknown.
void forget_velocity(Estimate& estimate) {
  estimate.P.topRightCorner<6, 6>().setZero();
  estimate.P.bottomLeftCorner<6, 6>().setZero();
  estimate.P.bottomRightCorner<6, 6>() = kInitialVelocity * kInitialVelocity * Matrix6d::Identity();
}

}  // namespace

Estimate initial_estimate(const Sample& first, double factor) {
  Estimate estimate;
  estimate.x.head<6>() = first.value;
  estimate.P.diagonal().head<6>() = factor * first.covariance.diagonal();
  estimate.P.diagonal().tail<6>().setConstant(kInitialVelocity * kInitialVelocity);
  return estimate;
}

Estimate predict(const Estimate& from, double dt, const Vector6d& density) {
  Estimate to;
  to.x.head<6>() = from.x.head<6>() + dt * from.x.tail<6>();
  to.x.tail<6>() = from.x.tail<6>();
  const auto A = from.P.topLeftCorner<6, 6>(), B = from.P.topRightCorner<6, 6>(),
             D = from.P.bottomRightCorner<6, 6>();
  to.P.topLeftCorner<6, 6>() = A + dt * (B + B.transpose()) + dt * dt * D;
  to.P.topRightCorner<6, 6>() = B + dt * D;
  to.P.bottomRightCorner<6, 6>() = D;
  to.P.topLeftCorner<6, 6>().diagonal() += dt * dt * dt / 3 * density;
  to.P.topRightCorner<6, 6>().diagonal() += dt * dt / 2 * density;
  to.P.bottomRightCorner<6, 6>().diagonal() += dt * density;
  to.P.bottomLeftCorner<6, 6>() = to.P.topRightCorner<6, 6>().transpose();
  return to;
}

Estimate update(const Estimate& predicted, const Vector6d& innovation, const Matrix6d& R) {
  const Eigen::LLT<Matrix6d> S(predicted.P.topLeftCorner<6, 6>() + R);
  const Eigen::Matrix<double, 6, 12> gain = S.solve(predicted.P.topRows<6>());
  Estimate updated;
  updated.x = predicted.x + gain.transpose() * innovation;
  updated.P = predicted.P - gain.transpose() * predicted.P.topRows<6>();
  updated.P = (0.5 * (updated.P + updated.P.transpose())).eval();
  return updated;
}

Noise noise_of(const std::array<double, 3>& logs) {
  Noise noise{.factor = std::exp(logs[0])};
  noise.acceleration.head<3>().setConstant(std::exp(logs[1]));
  noise.acceleration.tail<3>().setConstant(std::exp(logs[2]));
  return noise;
}

FilteredEnd filter_forward(std::span<const Sample> samples, const Noise& noise,
                           Improbable improbable) {
  FilteredEnd end{initial_estimate(samples.front(), noise.factor), 0};
  bool surprised = false;
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double dt = samples[k].timestamp - samples[k - 1].timestamp;
    const Matrix6d R = noise.factor * samples[k].covariance;
    Innovation innovation(predict(end.estimate, dt, noise.acceleration), samples[k], R);
    end.log_likelihood += innovation.log_likelihood();
    const bool surprising = innovation.chi2 > kImprobableChi2;
    if (improbable == Improbable::kThenVelocity && surprised && surprising) {
      forget_velocity(end.estimate);
      innovation = Innovation(predict(end.estimate, dt, noise.acceleration), samples[k], R);
    }
    surprised = surprising;
    const double weight = std::min(1.0, student_weight(innovation.chi2));
    end.estimate = update(innovation.predicted, innovation.difference, R / weight);
  }
  return end;
}

Matrix6d to_world(const Pose& T_world_camera) {
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = T_world_camera.rotation();
  return J;
}

std::vector<Sample> samples_of(std::span<const UncertainPose> poses) {
  std::vector<Sample> samples;
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose& T = poses[k].T_world_camera;
    if (k > 0) {
      rotation += so3_log(poses[k - 1].T_world_camera.quaternion().conjugate() * T.quaternion());
    }
    const Matrix6d J = to_world(T);
    Sample sample{poses[k].timestamp, {}, J * poses[k].covariance * J.transpose()};
    sample.value << T.translation(), rotation;
    samples.push_back(sample);
  }
  return samples;
}

Pose corrected(const Pose& T_world_camera, const Vector6d& correction) {
  return Pose(T_world_camera.quaternion() * so3_exp(correction.tail<3>()),
              T_world_camera.translation() + correction.head<3>());
}

}  // namespace stillmap
