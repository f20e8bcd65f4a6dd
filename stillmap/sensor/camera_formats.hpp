// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/recording/camera_model.hpp"

#include <filesystem>

namespace stillmap {

/// A camera as a file describes it.
struct FileCamera : Camera {
  LensDistortion lens;  ///< Camera::distortion is not set.
};

/// Reads a camera file in one of the formats that docs/cameras.md lists, recognized by its keys.
/// Width and height are 0, and the name is that of Camera(), if the file does not contain them.
/// Throws Error with file, key and fix; YAML::Exception for some damaged
/// files.
FileCamera read_camera_format(const std::filesystem::path& file);

}  // namespace stillmap
