// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include <opencv2/core.hpp>

/// Marks that several kinds of images share. Colors are B G R.
namespace stillmap {

inline const cv::Scalar kMovingColor(60, 60, 235);    ///< Keypoints and pixels labeled as moving.
inline const cv::Scalar kAgreeingColor(90, 220, 70);  ///< Keypoints that are used.
inline const cv::Scalar kOtherColor(60, 210, 240);    ///< Keypoints without a landmark.

/// Writes a line in white with a black outline; `at` is its lower left corner. A line that would
/// leave the image is moved to the left, and made smaller if it is wider than the image.
void write_line(cv::Mat& image, const std::string& text, const cv::Point& at);

/// Returns the pixels that such a line covers in an image of a size.
cv::Rect line_area(const cv::Size& image, const std::string& text, const cv::Point& at);

/// Returns the image with little color, so that colored marks are easy to see. 8UC3 BGR.
cv::Mat grayed(const cv::Mat& color);

}  // namespace stillmap
