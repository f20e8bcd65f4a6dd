// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// Levels of compression of PNG files: for images that a run waits for, and for those that are
/// kept.
inline constexpr int kFastPng = 1, kSmallPng = 6;

/// Returns an image as the bytes of a PNG file: gray or BGR of 8 or 16 bits, or BGRA of 8 bits.
std::string encode_png(const cv::Mat& image, int level = kSmallPng);

}  // namespace stillmap
