// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cmath>

namespace stillmap {

/// Writes a pose as seven doubles: quaternion x y z w, translation [m].
inline void put_pose(ByteWriter& out, const Pose& pose) {
  const Eigen::Quaterniond& q = pose.quaternion();
  for (const double x : {q.x(), q.y(), q.z(), q.w()}) out.put(x);
  for (const double x : pose.translation()) out.put(x);
}

/// Reads a pose bit-exactly. Throws Error if it is not finite or its quaternion is not of unit
/// length.
inline Pose get_pose(ByteReader& in) {
  Eigen::Quaterniond q;
  Eigen::Vector3d t;
  for (double& x : q.coeffs()) x = in.get<double>();  // x y z w
  for (double& x : t) x = in.get<double>();
  constexpr double kRounding = 1e-9;
  if (!(std::abs(q.norm() - 1) < kRounding) || !t.allFinite()) in.fail("a pose is invalid");
  return Pose::of_unit(q, t);
}

}  // namespace stillmap
