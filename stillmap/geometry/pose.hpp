// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stillmap {

/// Returns the skew-symmetric matrix [w]x with [w]x v = w x v.
Eigen::Matrix3d skew(const Eigen::Vector3d& w);

/// A rigid motion in SE(3). `T_a_b` maps coordinates in frame b to frame a: p_a = T_a_b * p_b;
/// names chain as in T_a_c = T_a_b * T_b_c. Translations are in meters.
class Pose {
 public:
  Pose() = default;
  Pose(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : q_(q.normalized()), t_(t) {}
  Pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) : Pose(Eigen::Quaterniond(R), t) {}
  /// Creates a pose from a unit quaternion without normalizing it, so that a pose read from a file
  /// is bit-exact.
  static Pose of_unit(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
    Pose pose;
    pose.q_ = q;
    pose.t_ = t;
    return pose;
  }

  /// Exponential of a twist (v, w), translation [m] first, then rotation [rad], both in the left
  /// (target) frame. Barfoot, State Estimation for Robotics (2017), eq. 7.83-7.86.
  static Pose exp(const Eigen::Matrix<double, 6, 1>& twist);
  /// Inverse of exp; the rotation part has norm <= pi.
  Eigen::Matrix<double, 6, 1> log() const;

  const Eigen::Quaterniond& quaternion() const { return q_; }
  const Eigen::Vector3d& translation() const { return t_; }
  Eigen::Matrix3d rotation() const { return q_.toRotationMatrix(); }

  Pose inverse() const {
    const Eigen::Quaterniond qi = q_.conjugate();
    return Pose(qi, qi * -t_);
  }
  Pose operator*(const Pose& other) const { return Pose(q_ * other.q_, q_ * other.t_ + t_); }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return q_ * p + t_; }

  /// Returns the rotation angle in [0, pi] [rad].
  double angle() const;

 private:
  Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_ = Eigen::Vector3d::Zero();
};

/// Exponential and logarithm of SO(3): rotation vector (axis times angle [rad]) to and from a unit
/// quaternion.
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& w);
Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);

/// Interpolates from a (s = 0) to b (s = 1): translation linearly, rotation by slerp.
Pose interpolate(const Pose& a, const Pose& b, double s);

}  // namespace stillmap
