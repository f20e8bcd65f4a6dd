// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/live_source.hpp"

#include <memory>
#include <string>

namespace stillmap {

/// Starts an Intel RealSense camera with color and depth images of 640 x 480 pixels at 30 Hz. Its
/// frames have depth that is registered to the color images.
/// @param name  serial number; a recorded file, which librealsense plays as a camera would; empty
///              for the first camera
/// @param ignore  Camera::ignore
/// Throws Error if there is no such camera, and if Stillmap was built without librealsense.
std::unique_ptr<LiveCamera> open_realsense(const std::string& name, const std::string& ignore);

}  // namespace stillmap
