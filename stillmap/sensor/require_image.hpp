// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// Throws Error unless the image has the size of the camera's images.
/// @param name   of the image, for the message: "depth image"
/// @param where  the function that got the image
void require_size(const cv::Mat& image, const Camera& camera, const std::string& name,
                  const std::string& where);

/// Throws Error that names the image and its type.
/// @param fix  the accepted types
[[noreturn]] void refuse_type(const cv::Mat& image, const std::string& name,
                              const std::string& where, const std::string& fix);

}  // namespace stillmap
