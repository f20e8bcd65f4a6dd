// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/gyro_prior.hpp"

#include "stillmap/base/statistics.hpp"

#include <Eigen/LU>
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Standard deviation of a measured rotation besides noise and bias: scale and alignment of the
/// axes and the time offset, relative to the rotation, and the shutters [rad].
constexpr double kScaleError = 0.01, kRotationError = 3e-4;
/// Number of frames whose differences are kept, and least number for a decision.
constexpr std::size_t kMemory = 60, kMinMemory = 5;
/// Median of the squared differences from which the gyroscope contradicts the images [sigma^2]:
/// that of the chi-square distribution with three degrees of freedom is 2.4.
constexpr double kContradiction = 12;

}  // namespace

bool GyroPrior::contradicts() const {
  return chi2_.size() >= kMinMemory && quantile(chi2_, 0.5) > kContradiction;
}

std::optional<Finding> GyroPrior::finding() const {
  if (left_out_ == 0 || 5 * left_out_ < compared_) return std::nullopt;
  return make_finding(
      "gyroscope-unlike",
      fmt::format(
          "the rotations of the gyroscope contradict those of the images; it was left out in "
          "{} of {} frames",
          left_out_, compared_),
      "check its axes (T_camera_imu), its unit (rad/s) and its clock (imu_time_offset)",
      {{"left_out", static_cast<double>(left_out_)}, {"frames", static_cast<double>(compared_)}});
}

std::optional<MotionPrior> GyroPrior::motion(const RgbdFrame& image, double before,
                                             const Matrix6d& covariance) {
  measured_.reset();
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
  if (contradicts()) return std::nullopt;
  const Eigen::Matrix3d& J = measured_->rotation_by_gyro();
  const Eigen::Matrix3d total = covariance_ + J * bias_->covariance() * J.transpose();
  const Eigen::Quaterniond q = imu_->T_camera_imu.quaternion();
  MotionPrior prior{.T_previous_camera =
                        Pose(q * rotation * q.conjugate(), Eigen::Vector3d::Zero())};
  prior.information.bottomRightCorner<3, 3>() = R_camera_imu * total.inverse() * R_imu_camera;
  return prior;
}

void GyroPrior::add(const RgbdFrame& image, const TrackedFrame& tracked) {
  if (!measured_ || !tracked.T_previous_camera || image.imu.empty()) return;
  const Eigen::Quaterniond q = imu_->T_camera_imu.quaternion();
  const Eigen::Quaterniond seen = q.conjugate() * tracked.T_previous_camera->quaternion() * q;
  const Eigen::Vector3d difference =
      so3_log(measured_->rotation(ImuBias{.gyro = bias_->mean()}).conjugate() * seen);
  const Eigen::Matrix3d R_imu_camera = q.conjugate().toRotationMatrix();
  const Eigen::Matrix3d covariance =
      covariance_ +
      R_imu_camera * tracked.covariance.bottomRightCorner<3, 3>() * R_imu_camera.transpose();
  const Eigen::Matrix3d& J = measured_->rotation_by_gyro();
  const Eigen::Matrix3d total = covariance + J * bias_->covariance() * J.transpose();
  chi2_.push_back(difference.dot(total.inverse() * difference));
  if (chi2_.size() > kMemory) chi2_.erase(chi2_.begin());
  ++compared_;
  left_out_ += contradicts();
  if (!contradicts()) bias_->add(*measured_, difference, covariance);
}

}  // namespace stillmap
