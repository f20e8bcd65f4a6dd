// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/gyro_prior.hpp"

#include <numbers>

#include <Eigen/LU>
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Standard deviation of a measured rotation besides noise and bias: scale and alignment of the
/// axes and the time offset, relative to the rotation, and the shutters [rad].
constexpr double kScaleError = 0.01, kRotationError = 3e-4;
/// Angular velocity above which images cannot be tracked anyway [rad/s].
constexpr double kMaxRate = 8;
/// A gyroscope that was left out in a fifth of the frames is told.
constexpr std::size_t kShare = 5;
/// Squared difference from which a rotation contradicts the gyroscope [sigma^2]: 99.9 % with three
/// degrees of freedom.
constexpr double kContradiction = 16.3;

}  // namespace

Finding GyroPrior::mounting_finding() const {
  const Pose& T = imu_->T_camera_imu;
  const double degrees = given_->angularDistance(T.quaternion()) * 180 / std::numbers::pi;
  const Eigen::Matrix3d R = T.rotation();
  const Eigen::Vector3d& t = T.translation();
  return make_finding(
      "gyroscope-unlike",
      fmt::format("the gyroscope is mounted otherwise than T_camera_imu says, by {:.0f} degrees; "
                  "the orientation that the images show is used",
                  degrees),
      fmt::format("write T_camera_imu: [{:.4f}, {:.4f}, {:.4f}, {:.3f}, {:.4f}, {:.4f}, {:.4f}, "
                  "{:.3f}, {:.4f}, {:.4f}, {:.4f}, {:.3f}, 0, 0, 0, 1] into the camera file",
                  R(0, 0), R(0, 1), R(0, 2), t.x(), R(1, 0), R(1, 1), R(1, 2), t.y(), R(2, 0),
                  R(2, 1), R(2, 2), t.z()),
      {{"angle_deg", degrees}});
}

std::optional<Finding> GyroPrior::finding() const {
  if (given_ && !contradicted()) return mounting_finding();
  if (left_out_ == 0 || kShare * left_out_ < compared_) return std::nullopt;
  const std::optional<double> offset = clock_.offset();
  return make_finding(
      "gyroscope-unlike",
      fmt::format(
          "the rotations of the gyroscope contradict those of the images{}; it was left out in "
          "{} of {} frames",
          offset ? fmt::format(": its clock is {:.2f} s {} theirs", std::abs(*offset),
                               *offset < 0 ? "behind" : "ahead of")
                 : "",
          left_out_, compared_),
      offset ? fmt::format("write imu_time_offset: {:.2f} into the camera file",
                           imu_->time_offset + *offset)
             : "check its axes (T_camera_imu), its unit (rad/s) and its clock (imu_time_offset)",
      {{"left_out", static_cast<double>(left_out_)}, {"frames", static_cast<double>(compared_)}});
}

/// Returns the covariance of a measured rotation with the part of the bias.
Eigen::Matrix3d GyroPrior::with_bias(const Eigen::Matrix3d& covariance) const {
  const Eigen::Matrix3d& J = measured_->rotation_by_gyro();
  return covariance + J * bias_->covariance() * J.transpose();
}

std::optional<MotionPrior> GyroPrior::motion(const RgbdFrame& image, double before,
                                             const Matrix6d& covariance) {
  measured_.reset();
  before_ = before;
  if (!imu_ || image.imu.empty()) return std::nullopt;
  measured_ =
      preintegrate(image.imu, before, image.timestamp, *imu_, ImuBias{.gyro = bias_->mean()});
  if (!measured_) return std::nullopt;
  const Eigen::Quaterniond rotation = measured_->rotation(measured_->bias());
  const Eigen::Matrix3d R_camera_imu = imu_->T_camera_imu.rotation();
  const Eigen::Matrix3d R_imu_camera = R_camera_imu.transpose();
  const double angle = so3_log(rotation).norm();
  covariance_ = measured_->covariance().topLeftCorner<3, 3>() +
                R_imu_camera * covariance.bottomRightCorner<3, 3>() * R_camera_imu;
  covariance_.diagonal().array() +=
      kRotationError * kRotationError + kScaleError * kScaleError * angle * angle;
  const bool too_fast = angle > kMaxRate * (image.timestamp - before);
  if (too_fast) contradictions_.add(true);
  if (too_fast || contradicted()) return std::nullopt;
  const Eigen::Quaterniond q = imu_->T_camera_imu.quaternion();
  MotionPrior prior{.T_previous_camera =
                        Pose(q * rotation * q.conjugate(), Eigen::Vector3d::Zero())};
  prior.information.bottomRightCorner<3, 3>() =
      R_camera_imu * with_bias(covariance_).inverse() * R_imu_camera;
  return prior;
}

std::optional<Imu> GyroPrior::compare(const RgbdFrame& image, const Pose& T_previous_camera,
                                      const Matrix6d& covariance) {
  if (!measured_) return std::nullopt;
  const Eigen::Quaterniond q = imu_->T_camera_imu.quaternion();
  const Eigen::Quaterniond seen = q.conjugate() * T_previous_camera.quaternion() * q;
  clock_.add(image.imu, before_, image.timestamp, seen, *imu_, {.gyro = bias_->mean()});
  if (const auto raw = preintegrate(image.imu, before_, image.timestamp, *imu_, {}))
    mounting_.add(so3_log(raw->rotation({})), so3_log(T_previous_camera.quaternion()));
  compare_rotation(seen, covariance);
  return contradictions_.too_many() ? mounted_otherwise() : std::nullopt;
}

void GyroPrior::compare_rotation(const Eigen::Quaterniond& seen, const Matrix6d& of_images) {
  const Eigen::Quaterniond measured = measured_->rotation({.gyro = bias_->mean()});
  const Eigen::Vector3d difference = so3_log(measured.conjugate() * seen);
  const Eigen::Matrix3d R_imu_camera = imu_->T_camera_imu.rotation().transpose();
  const Eigen::Matrix3d covariance =
      covariance_ + R_imu_camera * of_images.bottomRightCorner<3, 3>() * R_imu_camera.transpose();
  const Eigen::Matrix3d information = with_bias(covariance).inverse();
  const auto is_certain = [&](const Eigen::Vector3d& rotation) {
    return rotation.dot(information * rotation) > kContradiction;
  };
  const bool contradicts = is_certain(difference);
  // Any gyroscope agrees with a camera that hardly turns.
  if (is_certain(so3_log(seen)) || is_certain(so3_log(measured))) contradictions_.add(contradicts);
  ++compared_;
  left_out_ += contradicted();
  if (!contradicts) bias_->add(*measured_, difference, covariance);
}

std::optional<Imu> GyroPrior::mounted_otherwise() {
  const Eigen::Quaterniond q = imu_->T_camera_imu.quaternion();
  const auto mounted = mounting_.instead_of(q);
  if (!mounted) return std::nullopt;
  if (!given_) given_ = q;
  imu_->T_camera_imu = Pose(*mounted, imu_->T_camera_imu.translation());
  bias_.emplace(*imu_);
  measured_.reset();
  contradictions_.clear();
  clock_ = {};
  mounting_.clear();
  return imu_;
}

}  // namespace stillmap
