// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/preintegration.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Largest interval of samples between which the measurements are interpolated [s].
constexpr double kLargestGap = 0.05;

/// Returns the measurement at a time between two samples.
ImuSample between(const ImuSample& a, const ImuSample& b, double timestamp) {
  const double s = (timestamp - a.timestamp) / (b.timestamp - a.timestamp);
  return {timestamp, (1 - s) * a.angular_velocity + s * b.angular_velocity,
          (1 - s) * a.acceleration + s * b.acceleration};
}

/// Returns whether there is a gap of more than kLargestGap before a sample, in which there is none
/// or the same one is repeated.
bool follows_gap(std::span<const ImuSample> samples, std::size_t next) {
  std::size_t measured = next - 1;
  while (measured > 0 && samples[measured].repeats(samples[measured - 1])) --measured;
  return samples[next].timestamp - samples[measured].timestamp > kLargestGap;
}

}  // namespace

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d W = skew(w);
  if (angle < 1e-5) return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 6;
  const double squared = angle * angle;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / squared * W +
         (angle - std::sin(angle)) / (squared * angle) * W * W;
}

Preintegration::Preintegration(const Imu& imu, const ImuBias& bias)
    : gyro_variance_(imu.gyro_noise * imu.gyro_noise),
      accel_variance_(imu.accel_noise * imu.accel_noise),
      bias_(bias) {}

void Preintegration::integrate(const Eigen::Vector3d& angular_velocity,
                               const Eigen::Vector3d& acceleration, double dt) {
  const Eigen::Vector3d w = (angular_velocity - bias_.gyro) * dt, a = acceleration - bias_.accel;
  const Eigen::Matrix3d R = rotation_.toRotationMatrix(), Ra = R * skew(a), J = right_jacobian(w);
  const Eigen::Matrix3d turn = so3_exp(w).toRotationMatrix().transpose();

  // Error of (rotation, velocity, position): propagated by A; B is its derivative by the noise.
  Matrix9d A = Matrix9d::Identity();
  A.block<3, 3>(0, 0) = turn;
  A.block<3, 3>(3, 0) = -Ra * dt;
  A.block<3, 3>(6, 0) = -0.5 * Ra * dt * dt;
  A.block<3, 3>(6, 3) = Eigen::Matrix3d::Identity() * dt;
  Eigen::Matrix<double, 9, 3> B_gyro = Eigen::Matrix<double, 9, 3>::Zero(), B_accel = B_gyro;
  B_gyro.topRows<3>() = J * dt;
  B_accel.middleRows<3>(3) = R * dt;
  B_accel.bottomRows<3>() = 0.5 * R * dt * dt;
  covariance_ = A * covariance_ * A.transpose() +
                gyro_variance_ / dt * B_gyro * B_gyro.transpose() +
                accel_variance_ / dt * B_accel * B_accel.transpose();

  position_by_accel_ += velocity_by_accel_ * dt - 0.5 * R * dt * dt;
  position_by_gyro_ += velocity_by_gyro_ * dt - 0.5 * Ra * rotation_by_gyro_ * dt * dt;
  velocity_by_accel_ -= R * dt;
  velocity_by_gyro_ -= Ra * rotation_by_gyro_ * dt;
  rotation_by_gyro_ = turn * rotation_by_gyro_ - J * dt;

  position_ += velocity_ * dt + 0.5 * dt * dt * (R * a);
  velocity_ += R * a * dt;
  rotation_ = (rotation_ * so3_exp(w)).normalized();
  seconds_ += dt;
}

Eigen::Quaterniond Preintegration::rotation(const ImuBias& bias) const {
  return rotation_ * so3_exp(rotation_by_gyro_ * (bias.gyro - bias_.gyro));
}

Eigen::Vector3d Preintegration::velocity(const ImuBias& bias) const {
  return velocity_ + velocity_by_gyro_ * (bias.gyro - bias_.gyro) +
         velocity_by_accel_ * (bias.accel - bias_.accel);
}

Eigen::Vector3d Preintegration::position(const ImuBias& bias) const {
  return position_ + position_by_gyro_ * (bias.gyro - bias_.gyro) +
         position_by_accel_ * (bias.accel - bias_.accel);
}

Eigen::Matrix<double, 9, 6> Preintegration::by_bias() const {
  Eigen::Matrix<double, 9, 6> J;
  J << rotation_by_gyro_, Eigen::Matrix3d::Zero(), velocity_by_gyro_, velocity_by_accel_,
      position_by_gyro_, position_by_accel_;
  return J;
}

std::optional<Preintegration> preintegrate(std::span<const ImuSample> samples, double begin,
                                           double end, const Imu& imu, const ImuBias& bias) {
  const auto earlier = [](const ImuSample& sample, double time) { return sample.timestamp < time; };
  const auto last = std::lower_bound(samples.begin(), samples.end(), end, earlier);
  const auto after = std::upper_bound(
      samples.begin(), samples.end(), begin,
      [](double time, const ImuSample& sample) { return time < sample.timestamp; });
  if (last == samples.end() || after == samples.begin() || end <= begin) return std::nullopt;
  Preintegration result(imu, bias);
  ImuSample from = between(*(after - 1), *after, begin);
  for (auto next = after; next <= last; ++next) {
    if (follows_gap(samples, static_cast<std::size_t>(next - samples.begin()))) return std::nullopt;
    const ImuSample to = next->timestamp < end ? *next : between(*(next - 1), *next, end);
    const double dt = to.timestamp - from.timestamp;
    if (dt <= 0) continue;
    result.integrate((from.angular_velocity + to.angular_velocity) / 2,
                     (from.acceleration + to.acceleration) / 2, dt);
    from = to;
  }
  return result;
}

}  // namespace stillmap
