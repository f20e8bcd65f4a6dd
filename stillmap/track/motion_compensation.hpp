// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/optimize/residual.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap {

/// Times at which the rows of a frame are exposed.
struct ShutterTiming {
  double readout = 0;      ///< Time from the first to the last row of an image [s].
  double depth_delay = 0;  ///< Time of the depth image minus its timestamp [s].
};

/// Returns the features as a camera would observe them that exposes all rows of the color and the
/// depth image at the timestamp of the frame.
///
/// Row v of an image of height h is exposed (v / h - 1/2) * readout after the middle of the image.
/// A point p in the camera frame of that moment is at exp(xi dt) p in the camera frame of the
/// timestamp, for the camera's twist xi. The depth of a keypoint is read where its point lies in
/// the depth image, which is exposed at another time.
///
/// @param raw   features of the image as recorded
/// @param twist velocity (v, w) of the camera in its own frame [m/s, rad/s]
Features compensate_motion(const Features& raw, const RgbdFrame& image, const Camera& camera,
                           const ShutterTiming& timing, const Vector6d& twist);

}  // namespace stillmap
