// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// A decoded image, or the problem in words that follow the file name.
struct JpegRead {
  cv::Mat image;        ///< Pixels, 8UC3 BGR.
  std::string problem;  ///< Empty if there is an image.
};

/// Decodes a gray or color JPEG file like cv::imdecode, and detects damage that cv::imdecode
/// ignores: a JPEG has no checksum, but invalid codes and data that ends too early or too late are
/// detected. Other damage is not. Without libjpeg at build time cv::imdecode is used, and damage is
/// not detected.
/// @param bytes  a whole file that starts with a JPEG signature
JpegRead decode_jpeg(std::span<const unsigned char> bytes);

}  // namespace stillmap
