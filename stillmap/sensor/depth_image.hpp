// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Converts depth to 32FC1 [m]; 0 (unknown) for depths outside the sensor's range.
/// @param raw  16UC1 in units of 1 / depth_factor meters, where 0 and 65535 (saturation) are
/// unknown;
///             or 32FC1 in meters, where not-a-number is unknown
cv::Mat depth_in_meters(const cv::Mat& raw, double depth_factor, const DepthSensor& sensor);

/// Removes the systematic error of the disparity from a rectified depth image, 32FC1 [m]: z = 1 /
/// (1 / measured - error). Depths that leave the range of the camera's sensor become unknown.
void correct_disparity(const DisparityBias& bias, const Camera& camera, cv::Mat& depth);

}  // namespace stillmap
