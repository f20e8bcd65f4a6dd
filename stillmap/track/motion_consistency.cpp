// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/motion_consistency.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <cstddef>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

/// Number of poses whose differences are kept, and least number for a decision: 2 s and 0.5 s.
constexpr std::size_t kMemory = 60, kMinMemory = 15;
/// Variance of a pose extrapolated from two poses minus the third, in variances of one pose:
/// 1 + 4 + 1.
constexpr double kExtrapolation = 6;
/// Median of the chi-square distribution with six degrees of freedom.
constexpr double kMedianChi2 = 5.348;
/// Squared difference from which a pose contradicts the motion: 10 standard deviations, since the
/// accelerations of a hand are far from normal.
constexpr double kMaxChi2 = 100;
/// Poses in succession that contradict the motion before they are taken for the motion.
constexpr int kMaxContradictions = 3;
/// Longest time to the previous pose [s].
constexpr double kMaxGap = 0.2;

}  // namespace

void MotionConsistency::reset() { *this = {}; }

void MotionConsistency::move(const Pose& T_corrected_world) {
  if (last_) last_->T_world_camera = T_corrected_world * last_->T_world_camera;
}

/// Takes the velocity between the last pose and this one for that of the camera.
void MotionConsistency::follow(const UncertainPose& pose) {
  twist_.reset();
  if (last_) {
    const double dt = pose.timestamp - last_->timestamp;
    if (dt <= kMaxGap) twist_ = (last_->T_world_camera.inverse() * pose.T_world_camera).log() / dt;
  }
  last_ = pose;
  contradictions_ = 0;
}

std::optional<Eigen::Matrix<double, 6, 6>> MotionConsistency::contradiction(
    const UncertainPose& pose) {
  const bool comparable =
      twist_ && pose.timestamp - last_->timestamp <= kMaxGap && pose.covariance.trace() > 0;
  if (!comparable) {
    follow(pose);
    return std::nullopt;
  }
  const double dt = pose.timestamp - last_->timestamp;
  const Pose predicted = last_->T_world_camera * Pose::exp(dt * *twist_);
  const Eigen::Matrix<double, 6, 1> difference = (predicted.inverse() * pose.T_world_camera).log();
  const double chi2 = difference.dot(pose.covariance.ldlt().solve(difference)) / kExtrapolation;
  const double scale = std::max(1.0, quantile(chi2_, 0.5) / kMedianChi2);
  const bool contradicts = chi2_.size() >= kMinMemory && chi2 > kMaxChi2 * scale;
  chi2_.push_back(chi2);
  if (chi2_.size() > kMemory) chi2_.erase(chi2_.begin());
  const bool lasts = contradicts && contradictions_ == kMaxContradictions;
  if (lasts) last_.reset();  // the step is no velocity
  if (lasts || !contradicts) {
    follow(pose);
    return std::nullopt;
  }
  ++contradictions_;
  last_ = UncertainPose{pose.timestamp, predicted, pose.covariance};
  return pose.covariance * chi2 / (scale * kMedianChi2);
}

}  // namespace stillmap
