// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/residual.hpp"

#include <algorithm>
#include <array>

#include <ceres/ceres.h>

/// Poses as Ceres parameters: internal to the module.
namespace stillmap {

/// A pose as a Ceres parameter block: quaternion x y z w and translation.
using PoseBlock = std::array<double, 7>;

inline PoseBlock to_block(const Pose& T) {
  PoseBlock block;
  Eigen::Map<Eigen::Vector4d>{block.data()} = T.quaternion().coeffs();
  Eigen::Map<Eigen::Vector3d>{block.data() + 4} = T.translation();
  return block;
}

inline Pose to_pose(const double* block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(block)),
          Eigen::Map<const Eigen::Vector3d>(block + 4)};
}

/// SE(3) with left perturbations, x + delta = exp(delta) x. Residuals return their derivatives with
/// respect to delta in the first six of the seven columns that Ceres expects, so PlusJacobian is
/// [I; 0]. This avoids quaternion derivatives, which would cost more than the residual.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const PoseBlock sum = to_block(Pose::exp(Eigen::Map<const Vector6d>(delta)) * to_pose(x));
    std::copy(sum.begin(), sum.end(), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>{y_minus_x} = (to_pose(y) * to_pose(x).inverse()).log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

}  // namespace stillmap
