// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A frame at the resolution of mask propagation: reduced by an integer factor to a width of about
/// 320 pixels. Its pixels are called small pixels.
struct SmallFrame {
  int shrink = 1;
  cv::Size full_size;
  cv::Mat1b gray;   ///< Mean of each block of pixels.
  cv::Mat1f depth;  ///< Depth of one pixel of each block [m]; 0: unknown.

  explicit SmallFrame(const RgbdFrame& frame);
  cv::Size size() const { return gray.size(); }
  cv::Rect bounds() const { return {cv::Point(), size()}; }
};

/// A mask of a window of a small frame.
struct SmallMask {
  cv::Rect window;  ///< Window within the frame [small pixels].
  cv::Mat1b mask;   ///< Mask of the window's size, 255 on the object.
};

/// Returns an instance's mask at small size (its box if it has no mask). The window may be empty.
SmallMask shrink_mask(const Instance& instance, const SmallFrame& frame);

/// Returns `model` with the mask at full size; an empty box if nothing is left.
Instance enlarge_mask(const SmallMask& small, const SmallFrame& frame, const Instance& model);

}  // namespace stillmap
