// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/smooth_depth_error.hpp"

namespace stillmap {

/// Returns features without an error of their depths. Returns `features` if nothing changes.
/// @param removed  the error that they are without already
FeaturesPtr without_depth_error(const FeaturesPtr& features, const DepthErrorPtr& error,
                                const DepthErrorPtr& removed, const Camera& camera);

}  // namespace stillmap
