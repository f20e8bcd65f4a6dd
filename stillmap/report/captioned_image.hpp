// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// An image (8UC1, or 8UC3 BGR) with its caption.
struct CaptionedImage {
  cv::Mat image;
  std::string caption;
};

}  // namespace stillmap
