// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/gyro_bias.hpp"

#include <Eigen/LU>

namespace stillmap {

GyroBias::GyroBias(const Imu& imu)
    : walk_variance_(imu.gyro_walk * imu.gyro_walk),
      covariance_(imu.gyro_bias * imu.gyro_bias * Eigen::Matrix3d::Identity()) {}

void GyroBias::add(const Preintegration& measured, const Eigen::Vector3d& difference,
                   const Eigen::Matrix3d& covariance) {
  covariance_.diagonal().array() += walk_variance_ * measured.seconds();
  const Eigen::Matrix3d& J = measured.rotation_by_gyro();
  const Eigen::Matrix3d S = J * covariance_ * J.transpose() + covariance;
  const Eigen::Matrix3d K = covariance_ * J.transpose() * S.inverse();
  mean_ += K * difference;
  const Eigen::Matrix3d kept = Eigen::Matrix3d::Identity() - K * J;
  covariance_ = kept * covariance_ * kept.transpose() + K * covariance * K.transpose();
}

}  // namespace stillmap
