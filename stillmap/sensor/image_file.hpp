// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// What the first bytes of a PNG or JPEG file say about the image.
struct ImageHeader {
  cv::Size size;     ///< pixels
  int bits = 0;      ///< per channel
  int channels = 0;  ///< 1 gray, 2 gray with alpha, 3 color, 4 color with alpha
};

/// A header, or in `problem` why there is none, in words that follow a file's name ("is empty").
struct HeaderRead {
  ImageHeader header;
  std::string problem;  ///< empty if all is well
};

/// An image, or in `problem` why there is none.
struct ImageRead {
  cv::Mat image;        ///< empty if there is a problem
  std::string problem;  ///< empty if all is well
};

/// The header of a PNG or JPEG file, without decoding: a few microseconds. Also notices a file that
/// is missing, empty, of another kind, or cut short (its end mark is missing).
HeaderRead read_image_header(const std::filesystem::path& file);

/// Why an image of this header is no color (8 bits, gray or color) or depth (16 bits, one
/// channel) image; empty if it is one.
std::string color_problem(const ImageHeader& header);
std::string depth_problem(const ImageHeader& header);
/// Why an image is not of the wanted size; empty if it is.
std::string size_problem(const ImageHeader& header, cv::Size wanted);

/// Decodes an 8-bit PNG or JPEG file to 8UC3 BGR; gray comes out as three equal channels, alpha is
/// dropped. Refuses a size other than `wanted` before decoding. Never throws, never prints.
ImageRead read_color_image(const std::filesystem::path& file, cv::Size wanted);

/// Decodes a 16-bit single-channel PNG file to 16UC1, raw units. As read_color_image otherwise.
ImageRead read_depth_image(const std::filesystem::path& file, cv::Size wanted);

}  // namespace stillmap
