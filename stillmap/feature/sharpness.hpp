// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>

namespace stillmap {

/// How sharp a picture is: the mean squared difference of neighbouring 2x2 blocks (right and below)
/// on every fourth row of blocks, in squared grey values. Motion blur lowers it; it compares
/// pictures of one scene only, since what is in view matters as much.
/// @param grey 8UC1, at least 4x4 pixels
double sharpness(const cv::Mat& grey);

}  // namespace stillmap
