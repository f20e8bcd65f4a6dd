// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the pixels of an object without a mask as a mask of the box's size: those with depths of
/// the largest cluster in the center of the box. Consecutive depths of a cluster differ by less
/// than 10 cm. (YOLO11n's boxes include much background.)
cv::Mat1b cluster_in_box(const cv::Mat1f& depth, const cv::Rect& box);

}  // namespace stillmap
