// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/rigid_motion.hpp"

#include "stillmap/geometry/trajectory.hpp"

namespace stillmap {

std::optional<Pose> rigid_motion(std::span<const double, 16> matrix, double error) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(matrix.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool is_rotation = (R * R.transpose()).isIdentity(error) && R.determinant() > 0;
  if (!is_rotation || !T.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), error))
    return std::nullopt;
  return Pose(nearest_rotation(R), Eigen::Vector3d(T.topRightCorner<3, 1>()));
}

}  // namespace stillmap
