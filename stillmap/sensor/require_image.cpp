// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/require_image.hpp"

#include "stillmap/base/error.hpp"

#include <fmt/format.h>
#include <opencv2/core/check.hpp>

namespace stillmap {

void require_size(const cv::Mat& image, const Camera& camera, const std::string& name,
                  const std::string& where) {
  if (image.empty()) throw Error(fmt::format("the {} is empty", name), where, "give an image");
  if (image.cols == camera.width && image.rows == camera.height) return;
  throw Error(fmt::format("the {} has {} x {} pixels, those of the camera have {} x {}", name,
                          image.cols, image.rows, camera.width, camera.height),
              where, "make the camera's width and height those of the images");
}

void refuse_type(const cv::Mat& image, const std::string& name, const std::string& where,
                 const std::string& fix) {
  throw Error(fmt::format("the {} is of OpenCV's type {}", name, cv::typeToString(image.type())),
              where, fix);
}

}  // namespace stillmap
