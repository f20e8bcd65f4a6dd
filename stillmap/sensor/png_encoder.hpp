// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns an image as the bytes of a PNG file: gray or BGR of 8 or 16 bits, or BGRA of 8 bits.
std::string encode_png(const cv::Mat& image);

}  // namespace stillmap
