// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/adjoint.hpp"

namespace stillmap {

Eigen::Matrix<double, 6, 6> adjoint(const Pose& T) {
  const Eigen::Matrix3d R = T.rotation();
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = R;
  A.topRightCorner<3, 3>() = skew(T.translation()) * R;
  return A;
}

}  // namespace stillmap
