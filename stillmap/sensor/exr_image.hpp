// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/image_file.hpp"

#include <span>

namespace stillmap {

/// Returns whether bytes begin with the signature of an OpenEXR file.
bool is_exr(std::span<const unsigned char> bytes);

/// Returns the header of the depth channel of an image in scan lines: its only channel, or the one
/// named Z, Y or R. Half floats count as 32-bit floats, to which decode_exr() converts them.
/// @param bytes  the whole file, for which is_exr() holds
HeaderRead exr_header(std::span<const unsigned char> bytes);

/// Returns the channel of exr_header() as 32FC1; an empty image if the pixels are damaged.
/// @param bytes  a file whose exr_header() has no problem
cv::Mat decode_exr(std::span<const unsigned char> bytes);

}  // namespace stillmap
