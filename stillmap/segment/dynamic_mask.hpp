// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns a mask of the full image: 255 on every instance of the given classes, 0 elsewhere. An
/// instance without a mask counts with its whole box.
/// @param size image size [pixels]
cv::Mat1b dynamic_mask(const SegmentedFrame& frame, const std::vector<std::string>& classes,
                       cv::Size size);

}  // namespace stillmap
