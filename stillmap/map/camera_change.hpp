// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

namespace stillmap {

/// Returns whether two cameras have the same image size, intrinsics, baseline and depth sensor, but
/// for the rounding in a camera file. The distortion of the recorded images does not matter, since
/// keypoints are rectified.
bool same_images(const Camera& a, const Camera& b);

/// Returns the map as if its keyframes had been recorded by another camera: each keypoint is at the
/// pixel in which that camera would show it, at the level on which its patch would appear, rounded
/// and within the pyramid. Keypoints may lie outside the images of that camera. The depth
/// noise of the other camera's sensor is assumed for all depths.
MapContent with_camera(MapContent map, const Camera& camera);

}  // namespace stillmap
