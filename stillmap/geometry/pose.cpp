// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/pose.hpp"

#include <cmath>

namespace stillmap {
namespace {

/// Returns the left Jacobian of SO(3), the V with t = V v in the exponential map of SE(3).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
  const double theta2 = w.squaredNorm();
  const Eigen::Matrix3d W = skew(w);
  if (theta2 < 1e-10) return Eigen::Matrix3d::Identity() + 0.5 * W + W * W / 6.0;
  const double theta = std::sqrt(theta2);
  return Eigen::Matrix3d::Identity() + (1 - std::cos(theta)) / theta2 * W +
         (theta - std::sin(theta)) / (theta2 * theta) * W * W;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& w) {
  const double theta2 = w.squaredNorm();
  // sin(theta/2)/theta by its series near zero, to avoid cancellation.
  const double theta = std::sqrt(theta2);
  const double s = theta2 < 1e-8 ? 0.5 - theta2 / 48.0 : std::sin(0.5 * theta) / theta;
  return Eigen::Quaterniond(std::cos(0.5 * theta), s * w.x(), s * w.y(), s * w.z()).normalized();
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  // q and -q are the same rotation; use the smaller angle.
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double n = v.norm();
  if (n < 1e-9) return 2.0 * v;
  return 2.0 * std::atan2(n, sign * q.w()) / n * v;
}

Pose Pose::exp(const Eigen::Matrix<double, 6, 1>& twist) {
  const Eigen::Vector3d w = twist.tail<3>();
  return Pose(so3_exp(w), left_jacobian(w) * twist.head<3>());
}

Eigen::Matrix<double, 6, 1> Pose::log() const {
  Eigen::Matrix<double, 6, 1> twist;
  const Eigen::Vector3d w = so3_log(q_);
  twist << left_jacobian(w).partialPivLu().solve(t_), w;
  return twist;
}

double Pose::angle() const { return 2.0 * std::atan2(q_.vec().norm(), std::abs(q_.w())); }

Pose interpolate(const Pose& a, const Pose& b, double s) {
  return Pose(a.quaternion().slerp(s, b.quaternion()),
              (1 - s) * a.translation() + s * b.translation());
}

}  // namespace stillmap
