// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"

#include <functional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A mask of the whole image: 255 on every instance whose class is named, 0 elsewhere. An instance
/// without a mask counts with its whole box.
/// @param classes     names; empty for all
/// @param size        of the image, pixels
/// @param dilation_px radius by which everything grows, pixels; 0 for none
cv::Mat1b dynamic_mask(const SegmentedFrame& frame, const std::vector<std::string>& classes,
                       cv::Size size, int dilation_px = 0);

/// The same with a rule of one's own for what counts.
cv::Mat1b dynamic_mask(const SegmentedFrame& frame,
                       const std::function<bool(const Instance&)>& counts, cv::Size size,
                       int dilation_px = 0);

}  // namespace stillmap
