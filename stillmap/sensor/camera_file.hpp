// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/make_source.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the names of the camera presets, with intrinsics as published: tum_fr1, tum_fr2, tum_fr3
/// (TUM RGB-D benchmark, Sturm et al., IROS 2012), bonn (Bonn RGB-D Dynamic Dataset, Palazzolo et
/// al., IROS 2019), icl_nuim (Handa et al., ICRA 2014), seven_scenes (Shotton et al., CVPR 2013);
/// and kitchen (a Kinect with a focal length of 528 pixels).
const std::vector<std::string>& camera_presets();

/// Returns the size of the images of a camera; none if no image can be read.
using ImageSize = std::function<std::optional<cv::Size>()>;

/// Like read_camera(name_or_file), but uses `image_size` if the file does not contain the size of
/// the images.
Camera read_camera(const std::string& name_or_file, const ImageSize& image_size);

/// Returns the preset of the data set whose folder names are part of the path (TUM, Bonn,
/// ICL-NUIM); empty for other paths.
std::string camera_of_dataset(const std::filesystem::path& folder);

/// Writes a camera as YAML; read_camera() returns the same camera. Throws Error if the file cannot
/// be written.
void write_camera(const std::filesystem::path& file, const Camera& camera);

/// Throws Error (naming `where`) for impossible values: see read_camera(). The depth sensor must be
/// one of depth_sensor_names(), since files name it.
void check_camera(const Camera& camera, const std::string& where);

}  // namespace stillmap
