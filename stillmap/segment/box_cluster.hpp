// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>

namespace stillmap {

/// Estimates the mask of an object that has only a box, in the size of the box: pixels in the depth
/// range of the largest cluster of depths at the center of the box. Consecutive depths of a cluster
/// differ by less than 10 cm. (Boxes of YOLO11n contain much background.)
cv::Mat1b cluster_in_box(const cv::Mat1f& depth, const cv::Rect& box);

}  // namespace stillmap
