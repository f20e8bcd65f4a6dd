// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

namespace stillmap {

/// Returns Ad(T), which maps a twist (v, w) from T's source frame to its target frame: T exp(x) =
/// exp(Ad(T) x) T.
Eigen::Matrix<double, 6, 6> adjoint(const Pose& T);

}  // namespace stillmap
