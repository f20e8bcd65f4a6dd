// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/image_file.hpp"

#include <span>

namespace stillmap {

/// Returns whether a file begins as an array that numpy.save() wrote.
bool is_npy(std::span<const unsigned char> bytes);

/// Returns the header of an array of height x width (x 1) numbers as that of the image which
/// decode_npy() makes: floats of 64 bits count as 32 bits.
/// @param bytes  the whole file, for which is_npy() holds
HeaderRead npy_header(std::span<const unsigned char> bytes);

/// Returns the array as 16UC1 or 32FC1.
/// @param bytes  a file whose npy_header() has no problem, and samples of one of these two kinds
cv::Mat decode_npy(std::span<const unsigned char> bytes);

}  // namespace stillmap
