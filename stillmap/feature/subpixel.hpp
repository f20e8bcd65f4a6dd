// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/fast.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Position of a corner below the pixel: the top of the paraboloid fitted to the 3 x 3 scores
/// around it, at most half a pixel away in x and y.
cv::Point2f refine_corner(const cv::Mat& scores, const Corner& corner);

}  // namespace stillmap
