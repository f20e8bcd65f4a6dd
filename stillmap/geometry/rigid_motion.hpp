// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <optional>
#include <span>

namespace stillmap {

/// Returns the rigid motion in a 4 x 4 matrix, row by row, with the nearest rotation; none if the
/// product of its rotation with the transpose differs from the identity by more than `error`, if it
/// is a reflection, or if the last row is not 0 0 0 1.
/// @param error  by default that of numbers with few digits
std::optional<Pose> rigid_motion(std::span<const double, 16> matrix, double error = 1e-3);

}  // namespace stillmap
