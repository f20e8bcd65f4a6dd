// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/image_file.hpp"

#include <span>

namespace stillmap {

/// Returns whether a file begins as a TIFF file, of either byte order.
bool is_tiff(std::span<const unsigned char> bytes);

/// Returns the header of the first image of a TIFF file. Unlike those of PNG and JPEG it may stand
/// behind the pixels, so all bytes of the file are needed; a file that ends before its pixels do is
/// a problem.
/// @param bytes  a file for which is_tiff() holds
HeaderRead tiff_header(std::span<const unsigned char> bytes);

/// Decodes one channel of 8, 16 or 32 bits as it is stored (8UC1, 16UC1, 32FC1), everything else of
/// 8 bits to 8UC3 BGR. Returns an empty image if the pixels are damaged.
/// @param bytes  a file whose tiff_header() has no problem
cv::Mat decode_tiff(std::span<const unsigned char> bytes);

}  // namespace stillmap
