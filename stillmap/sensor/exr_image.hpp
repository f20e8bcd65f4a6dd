// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/image_file.hpp"

#include <span>

namespace stillmap {

/// Returns whether a file begins as an OpenEXR file.
bool is_exr(std::span<const unsigned char> bytes);

/// Returns the header of the channel with the depth of an image in rows: its only channel, or that
/// named Z, Y or R. Half and full floats both count as floats of 32 bits, as decode_exr() makes
/// them.
/// @param bytes  the whole file, for which is_exr() holds
HeaderRead exr_header(std::span<const unsigned char> bytes);

/// Returns the channel of exr_header() as 32FC1; an empty image if the pixels are damaged.
/// @param bytes  a file whose exr_header() has no problem
cv::Mat decode_exr(std::span<const unsigned char> bytes);

}  // namespace stillmap
