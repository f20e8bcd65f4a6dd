// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// A decoded image, or in `problem` why there is none, in words that follow the file's name.
struct JpegRead {
  cv::Mat image;        ///< 8UC3 BGR
  std::string problem;  ///< empty if there is an image
};

/// Decodes a gray or color JPEG file, as cv::imdecode does, and notices damage that cv::imdecode
/// passes over: a JPEG has no checksum, but codes that do not exist are seen, and data that ends
/// too early or too late. What happens to fit is not. Without libjpeg at hand when this was built
/// it is cv::imdecode, and no damage is seen.
/// @param bytes a whole file that starts with a JPEG's signature
JpegRead decode_jpeg(std::span<const unsigned char> bytes);

}  // namespace stillmap
