// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/make_source.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the names of the camera presets: tum_fr1, tum_fr2, tum_fr3 (TUM RGB-D benchmark, Sturm
/// et al., IROS 2012; intrinsics as published) and kitchen (a Kinect with a focal length of 528
/// pixels).
const std::vector<std::string>& camera_presets();

/// Writes a camera as YAML; read_camera() returns the same camera. Throws Error if the file cannot
/// be written.
void write_camera(const std::filesystem::path& file, const Camera& camera);

/// Throws Error (naming `where`) for impossible values: see read_camera(). The depth sensor must be
/// one of depth_sensor_names(), since files name it.
void check_camera(const Camera& camera, const std::string& where);

}  // namespace stillmap
