// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/fast.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the sub-pixel position of a corner: the maximum of a paraboloid fitted to the 3 x 3
/// scores around it, at most half a pixel away in x and y.
cv::Point2f refine_corner(const cv::Mat& scores, const Corner& corner);

}  // namespace stillmap
