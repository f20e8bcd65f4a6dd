// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/image_file.hpp"

#include <span>

namespace stillmap {

/// Returns whether bytes begin with the signature of numpy.save().
bool is_npy(std::span<const unsigned char> bytes);

/// Returns the header of the image that decode_npy() makes from an array of height x width (x 1)
/// numbers: 64-bit floats count as 32-bit floats.
/// @param bytes  the whole file, for which is_npy() holds
HeaderRead npy_header(std::span<const unsigned char> bytes);

/// Returns the array as 16UC1 or 32FC1.
/// @param bytes  a file whose npy_header() has no problem, and with 16-bit unsigned or float
/// samples
cv::Mat decode_npy(std::span<const unsigned char> bytes);

}  // namespace stillmap
