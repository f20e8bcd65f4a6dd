// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/gyro_mounting.hpp"

#include "stillmap/geometry/trajectory.hpp"

#include <Eigen/Eigenvalues>

namespace stillmap {
namespace {

/// Number of motions that are remembered, five seconds at 30 Hz, and least number for a result.
constexpr std::size_t kMost = 150, kLeast = 60;
/// Largest standard deviation of a result [rad].
constexpr double kCertain = 0.009;
/// Largest share of the sum of squared differences that is left.
constexpr double kLeftOver = 0.25;

}  // namespace

void GyroMounting::add(const Eigen::Vector3d& measured, const Eigen::Vector3d& seen) {
  pairs_.push_back({measured, seen});
  if (pairs_.size() > kMost) pairs_.pop_front();
}

std::optional<Eigen::Quaterniond> GyroMounting::instead_of(
    const Eigen::Quaterniond& R_camera_imu) const {
  if (pairs_.size() < kLeast) return std::nullopt;
  const auto n = static_cast<double>(pairs_.size());
  Pair mean{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (const Pair& pair : pairs_) {
    mean.measured += pair.measured / n;
    mean.seen += pair.seen / n;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero(), spread = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pairs_) {
    const Eigen::Vector3d m = pair.measured - mean.measured;
    covariance += (pair.seen - mean.seen) * m.transpose();
    spread += m * m.transpose();
  }
  Eigen::Quaterniond R(nearest_rotation(covariance));
  const auto squares = [&](const Eigen::Quaterniond& q) {
    double sum = 0;
    for (const Pair& pair : pairs_)
      sum += (pair.seen - mean.seen - q * (pair.measured - mean.measured)).squaredNorm();
    return sum;
  };
  const double left = squares(R), variance = left / (3 * n - 6);
  // Of a rotation about an axis, only the motions about the others tell.
  const Eigen::Matrix3d information = spread.trace() * Eigen::Matrix3d::Identity() - spread;
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(information, Eigen::EigenvaluesOnly)
          .eigenvalues()
          .x();
  if (variance > kCertain * kCertain * least || left > kLeftOver * squares(R_camera_imu))
    return std::nullopt;
  return R;
}

}  // namespace stillmap
