// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// How an image sits in a network's input: scaled to fit with its aspect kept, centered, the rest
/// filled with gray (114). Pixel centers at integers, in both.
struct Letterbox {
  double scale = 1;             ///< input pixels per image pixel
  double pad_x = 0, pad_y = 0;  ///< input pixels left of and above the image; whole numbers
  cv::Size image, input;        ///< pixels
  cv::Size inner;               ///< pixels of the input that the image covers

  Letterbox(cv::Size image_size, cv::Size input_size);

  /// Image position (edges: pixel i covers i to i + 1) of an input position.
  cv::Point2f to_image(cv::Point2f input_edge) const;
  /// Input position (edges) of an image position.
  cv::Point2f to_input(cv::Point2f image_edge) const;

  /// The input of a network: 3 x height x width planes, RGB, 0 to 1. `color` is 8UC3 BGR of size
  /// `image`.
  void fill(const cv::Mat& color, std::vector<float>& planes) const;
};

}  // namespace stillmap
