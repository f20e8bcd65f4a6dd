// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns why the chunks of a PNG file are invalid (truncated, wrong checksum), in words that
/// follow the file name; empty if they are valid. `bytes` is a whole file that starts with a PNG
/// signature and header.
std::string png_damage(std::span<const unsigned char> bytes);

/// Decodes a PNG: gray to 1 channel, color to BGR, with alpha to 2 or 4 channels; up to 8 bits to
/// 8U, 16 to 16U. The kinds that cameras write (8-bit gray and color, 16-bit gray) take about half
/// of libpng's time, since decoding two images per frame dominates the reading of a sequence:
/// libdeflate inflates the whole image at once, and three slow row filters are vectorized.
/// @param bytes  a PNG file without png_damage()
/// @return an empty image if the compressed pixels are damaged
cv::Mat decode_png(std::span<const unsigned char> bytes);

}  // namespace stillmap
