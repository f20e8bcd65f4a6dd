// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>

#include <opencv2/core.hpp>

namespace stillmap {

/// One color image and the depth registered to it, rectified: an ideal pinhole's view. Never
/// changed once made; passed on as shared_ptr<const RgbdFrame>.
struct RgbdFrame {
  std::size_t index = 0;  ///< 0, 1, 2 ... in the order of the source, skipped frames not counted
  double timestamp = 0;   ///< seconds, of the color image
  cv::Mat color;          ///< height x width, 8UC3 BGR; a gray camera's gray three times
  cv::Mat gray;           ///< height x width, 8UC1
  cv::Mat depth;          ///< height x width, 32FC1 meters along the optical axis; 0 where unknown
};

using RgbdFramePtr = std::shared_ptr<const RgbdFrame>;

}  // namespace stillmap
