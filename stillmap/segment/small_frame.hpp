// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A frame at the size that masks are carried at: the full image shrunk by a whole number, so that
/// it is about 320 pixels wide. "Small pixels" are its pixels.
struct SmallFrame {
  int shrink = 1;
  cv::Size full_size;
  cv::Mat1b gray;   ///< mean of each block
  cv::Mat1f depth;  ///< meters, of one pixel of each block; 0 where unknown

  explicit SmallFrame(const RgbdFrame& frame);
  cv::Size size() const { return gray.size(); }
  cv::Rect bounds() const { return {cv::Point(), size()}; }
};

/// A mask of part of a small frame.
struct SmallMask {
  cv::Rect window;  ///< small pixels, within the frame
  cv::Mat1b mask;   ///< of the window's size, 255 on the thing
};

/// An instance's mask at small size (its box where it has no mask). The window may be empty.
SmallMask shrink_mask(const Instance& instance, const SmallFrame& frame);

/// `model` with the mask brought back to full size; an empty box where nothing is left.
Instance enlarge_mask(const SmallMask& small, const SmallFrame& frame, const Instance& model);

}  // namespace stillmap
