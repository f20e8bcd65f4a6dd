// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/wheel_navigation.hpp"

#include "stillmap/geometry/adjoint.hpp"
#include "stillmap/geometry/contradiction.hpp"

#include <algorithm>

namespace stillmap {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Longest time between two samples between which a pose is interpolated [s].
constexpr double kLargestGap = 0.3;
/// Speeds above which an odometry was set back or jumped [m/s], [rad/s].
constexpr double kMaxSpeed = 10, kMaxTurn = 10;
/// Standard deviations of any motion by wheels: unevenness of the floor [m], [rad].
constexpr double kMeters = 2e-3, kRadians = 2e-3;
/// Length and angle of the motions that are compared with the images' [m], [rad].
constexpr double kComparedLength = 0.2, kComparedAngle = 0.2;
/// Age of the earliest pose from which the wheels continue [s].
constexpr double kEarlier = 0.5;

/// Returns the pose between the samples around a time; none if there are none.
std::optional<Pose> pose_at(std::span<const OdometrySample> samples, double time) {
  const auto after = std::lower_bound(
      samples.begin(), samples.end(), time,
      [](const OdometrySample& sample, double at) { return sample.timestamp < at; });
  if (after == samples.end()) return std::nullopt;
  if (after->timestamp == time) return after->T_odom_base;
  if (after == samples.begin()) return std::nullopt;
  const OdometrySample &a = *(after - 1), &b = *after;
  const double gap = b.timestamp - a.timestamp;
  if (gap > kLargestGap) return std::nullopt;
  return interpolate(a.T_odom_base, b.T_odom_base, (time - a.timestamp) / gap);
}

}  // namespace

void WheelNavigation::propagate(std::span<const OdometrySample> samples, double timestamp) {
  const auto before = pose_at(samples, timestamp_), now = pose_at(samples, timestamp);
  const double seconds = timestamp - timestamp_;
  timestamp_ = timestamp;
  const Pose T_before_now = before && now ? before->inverse() * *now : Pose();
  const bool jumps = T_before_now.translation().norm() > kMaxSpeed * seconds ||
                     T_before_now.angle() > kMaxTurn * seconds;
  if (jumps) contradictions_.add(true);
  if (!before || !now || jumps) {
    starts_.clear();
    compared_.reset();
    return;
  }
  const Pose T_camera = wheels_.T_camera_base * T_before_now * wheels_.T_camera_base.inverse();
  const auto add = [&](Motion& motion) {
    motion.T_start_camera = motion.T_start_camera * T_camera;
    motion.length += T_before_now.translation().norm();
    motion.angle += T_before_now.angle();
  };
  for (Start& start : starts_) add(start.since);
  if (compared_) add(compared_->since);
}

/// Returns the covariance of a motion. The errors of a scale accumulate, and one of the angle moves
/// the end of the path.
Matrix6d WheelNavigation::covariance(const Motion& motion) const {
  const double angle =
      kRadians + wheels_.angle_error * motion.angle + wheels_.angle_per_length * motion.length;
  const double length = kMeters + wheels_.length_error * motion.length + angle * motion.length / 2;
  Eigen::Matrix<double, 6, 1> variance;
  variance.head<3>().setConstant(length * length);
  variance.tail<3>().setConstant(angle * angle);
  const Matrix6d J = adjoint(wheels_.T_camera_base);
  return J * variance.asDiagonal() * J.transpose();
}

/// Compares the wheels with the images over motions that are long enough.
void WheelNavigation::compare(const UncertainPose& pose) {
  if (compared_ && compared_->since.length < kComparedLength &&
      compared_->since.angle < kComparedAngle)
    return;
  if (compared_) {
    const auto& [start, since] = *compared_;
    const Pose seen = start.T_world_camera.inverse() * pose.T_world_camera;
    const Eigen::Matrix<double, 6, 1> difference = (since.T_start_camera.inverse() * seen).log();
    const Matrix6d S = covariance(since) + start.covariance + pose.covariance;
    contradictions_.add(squared_sigmas(difference, S) > kContradiction);
  }
  compared_ = Start{pose, {}};
}

void WheelNavigation::correct(const UncertainPose& pose, bool same_world) {
  if (!same_world) {
    compared_.reset();
    starts_.clear();
  }
  compare(pose);
  timestamp_ = pose.timestamp;
  starts_.push_back({pose, {}});
  while (starts_.front().pose.timestamp < timestamp_ - kEarlier) starts_.pop_front();
}

UncertainPose WheelNavigation::moved(const Start& start) const {
  const auto& [pose, since] = start;
  const Matrix6d J = adjoint(since.T_start_camera.inverse());
  return {timestamp_, pose.T_world_camera * since.T_start_camera,
          J * pose.covariance * J.transpose() + covariance(since)};
}

std::optional<UncertainPose> WheelNavigation::pose() const {
  if (starts_.empty() || contradicted()) return std::nullopt;
  return moved(starts_.back());
}

std::optional<UncertainPose> WheelNavigation::pose_since_earlier() const {
  if (starts_.empty() || contradicted()) return std::nullopt;
  return moved(starts_.front());
}

}  // namespace stillmap
