// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/warn/zone.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the share of a zone that a camera sees [0..1]: of points 0.25 m apart at half of its
/// height (at most 1 m above its lower end), those inside the image with a measured depth that does
/// not end more than 0.3 m before them.
/// @param depth  of the image [m]; 0 where it is not known
double seen_share(const Zone& zone, const Camera& camera, const Pose& T_world_camera,
                  const cv::Mat1f& depth);

}  // namespace stillmap
