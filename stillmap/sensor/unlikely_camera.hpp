// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"

#include <optional>

namespace stillmap {

/// Returns the finding that hardly any camera has these intrinsics: cx and cy exchanged, pixels
/// that are not square, a principal point in the outer quarters of the image, or a field of view
/// outside 14 to 136 degrees. None if they are usual, or not set.
std::optional<Finding> unlikely_camera_finding(const Camera& camera);

}  // namespace stillmap
