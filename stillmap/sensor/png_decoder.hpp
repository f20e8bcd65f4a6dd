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

/// Returns whether decode_png() supports this kind of PNG: 8-bit gray, 8-bit color with or without
/// alpha, 16-bit gray; not interlaced.
bool decodes_png(std::span<const unsigned char> bytes);

/// Decodes the kinds of PNG that cameras write: 8-bit gray to 8UC1, 8-bit color to 8UC3 BGR, 8-bit
/// color with alpha to 8UC4 BGRA, 16-bit gray to 16UC1. Takes about half of libpng's time, since
/// decoding two images per frame dominates the reading of a sequence: libdeflate inflates the whole
/// image at once, and the two slow row filters are vectorized.
/// @param bytes  a PNG file without png_damage() and supported by decodes_png()
/// @return an empty image if the compressed pixels are damaged
cv::Mat decode_png(std::span<const unsigned char> bytes);

}  // namespace stillmap
