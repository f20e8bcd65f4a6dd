// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/sensor/inertial_source.hpp"

#include <vector>

namespace stillmap {

/// Returns the findings about samples that cannot be right, without the images: accelerations
/// whose median is not that of gravity in m/s^2, angular velocities beyond those that sensors
/// measure, as in degrees/s, and gaps, in which there is none or the same one is repeated.
std::vector<Finding> motion_findings(const MotionSamples& samples);

}  // namespace stillmap
