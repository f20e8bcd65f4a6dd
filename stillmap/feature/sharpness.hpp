// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>

namespace stillmap {

/// How sharp a picture is: the mean squared difference of neighboring 2x2 blocks (right and below)
/// on every fourth row of blocks, in squared gray values. Motion blur lowers it; it compares
/// pictures of one scene only, since what is in view matters as much.
/// @param gray 8UC1, at least 4x4 pixels
double sharpness(const cv::Mat& gray);

}  // namespace stillmap
