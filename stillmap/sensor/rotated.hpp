// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap {

/// Returns the ideal pinhole camera of images turned clockwise, for cameras that were held upright
/// or mounted upside down. Its poses are those of the turned camera: x right and y down in the
/// turned images. Throws Error if the angle is not 0, 90, 180 or 270, or the camera has a known
/// readout time, which is that of rows.
/// @param degrees  angle by which the recorded images are turned clockwise
Camera rotated(const Camera& camera, int degrees);

/// Returns the pose of the turned camera in the frame of the recorded one.
Pose turned_camera(int degrees);

/// Returns the frame with turned images.
RgbdFrame rotated(const RgbdFrame& frame, int degrees);

}  // namespace stillmap
