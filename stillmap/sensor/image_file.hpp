// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/png_encoder.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Kind of the numbers of an image.
enum class Samples { kUnsigned, kFloat, kOther };

/// Image properties from the header of a file.
struct ImageHeader {
  cv::Size size;     ///< Image size [pixels].
  int bits = 0;      ///< Bits per channel.
  int channels = 0;  ///< Channels: 1 gray, 2 gray with alpha, 3 color, 4 color with alpha.
  Samples samples = Samples::kUnsigned;
};

/// A header, or the problem in words that follow a file name ("is empty").
struct HeaderRead {
  ImageHeader header;
  std::string problem;  ///< Empty if there is no problem.
};

/// An image, or the problem.
struct ImageRead {
  cv::Mat image;        ///< Empty if there is a problem.
  std::string problem;  ///< Empty if there is no problem.
};

/// Reads the header of a PNG, JPEG or TIFF file, a NumPy array or an OpenEXR file without decoding,
/// in a few microseconds (the last three are read as a whole). Also detects a file that is missing,
/// empty, of another type, or truncated.
HeaderRead read_image_header(const std::filesystem::path& file);

/// Returns why an image with this header is not a color image (8 bits, gray or color) or not a
/// depth image (one channel of 16 bits or of 32-bit floats); empty if it is one.
std::string color_problem(const ImageHeader& header);
std::string depth_problem(const ImageHeader& header);
/// Returns why an image does not have the wanted size; empty if it has.
std::string size_problem(const ImageHeader& header, cv::Size wanted);

/// Decodes an 8-bit PNG, JPEG or TIFF file to 8UC3 BGR; gray gives three equal channels, alpha is
/// dropped. Checks the size before decoding. Never throws, never prints.
ImageRead read_color_image(const std::filesystem::path& file, cv::Size wanted);

/// Decodes a single-channel file to 16UC1 [raw units], or a file of floats (TIFF, .npy, .exr) to
/// 32FC1 [m]; otherwise like read_color_image().
ImageRead read_depth_image(const std::filesystem::path& file, cv::Size wanted);

/// The same for the bytes of a file in memory.
ImageRead decode_color_image(std::span<const unsigned char> bytes, cv::Size wanted);
ImageRead decode_depth_image(std::span<const unsigned char> bytes, cv::Size wanted);

/// Returns the header of an image in memory, as read_image_header().
HeaderRead decode_image_header(std::span<const unsigned char> bytes);

/// Reads an image of any of these kinds as it is stored: 1 to 4 channels of 8 or 16 bits, or
/// floats; colors as BGR. Never throws, never prints.
ImageRead read_stored_image(const std::filesystem::path& file);

/// Writes an image as a PNG file (encode_png()). Throws Error if that fails.
void write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace stillmap
