// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include <opencv2/core.hpp>

namespace stillmap {

/// Placement of an image in a network's input: scaled with constant aspect ratio, centered, the
/// rest filled with gray (114). Pixel centers are at integers in both.
struct Letterbox {
  double scale = 1;  ///< Scale [input pixels per image pixel].
  /// Padding left of and above the image [input pixels]; whole numbers.
  double pad_x = 0, pad_y = 0;
  cv::Size image, input;  ///< Sizes [pixels].
  cv::Size inner;         ///< Size of the image in the input [pixels].

  Letterbox(cv::Size image_size, cv::Size input_size);

  /// Returns the image position of an input position (edge coordinates: pixel i covers i to i + 1).
  cv::Point2f to_image(cv::Point2f input_edge) const;
  /// Returns the input position of an image position (edge coordinates).
  cv::Point2f to_input(cv::Point2f image_edge) const;

  /// Computes the network input: planes of 3 x height x width, RGB, 0 to 1. `color` is 8UC3 BGR of
  /// size `image`; `planes` has three times the area of `input`.
  void fill(const cv::Mat& color, std::span<float> planes) const;
};

}  // namespace stillmap
