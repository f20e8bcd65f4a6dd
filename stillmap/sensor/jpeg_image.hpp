// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A decoded image, or the problem in words that follow the file name.
struct JpegRead {
  cv::Mat image;        ///< Pixels, 8UC3 BGR.
  std::string problem;  ///< Empty if there is an image.
};

/// Decodes a gray or color JPEG file. A JPEG has no checksum, but invalid codes and data that ends
/// too early or too late are detected as damage. Other damage is not.
/// @param bytes  a whole file that starts with a JPEG signature
JpegRead decode_jpeg(std::span<const unsigned char> bytes);

/// Returns an image (8UC1, or 8UC3 BGR) as the bytes of a JPEG file.
/// @param quality  1 to 100
std::vector<unsigned char> encode_jpeg(const cv::Mat& image, int quality);

}  // namespace stillmap
