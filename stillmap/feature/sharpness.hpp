// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the sharpness of an image: the mean squared difference of neighboring 2x2 blocks (right
/// and below) on every fourth row of blocks [squared gray values]. Motion blur lowers it; only
/// images of the same scene are comparable.
/// @param gray  8UC1, at least 4x4 pixels
double sharpness(const cv::Mat& gray);

}  // namespace stillmap
