// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"

#include <functional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns a mask of the full image: 255 on every instance of the given classes, 0 elsewhere. An
/// instance without a mask counts with its whole box.
/// @param classes      class names; empty for all
/// @param size         image size [pixels]
/// @param dilation_px  dilation radius [pixels]; 0 for none
cv::Mat1b dynamic_mask(const SegmentedFrame& frame, const std::vector<std::string>& classes,
                       cv::Size size, int dilation_px = 0);

/// The same with a custom predicate for instances.
cv::Mat1b dynamic_mask(const SegmentedFrame& frame,
                       const std::function<bool(const Instance&)>& counts, cv::Size size,
                       int dilation_px = 0);

}  // namespace stillmap
