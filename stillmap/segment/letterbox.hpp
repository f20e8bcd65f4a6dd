// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <span>

#include <opencv2/core.hpp>

namespace stillmap {

/// Values of the pixels in a network's input: scale * byte + offset of each channel (blue, green,
/// red), in planes or pixel by pixel.
struct PixelFormat {
  bool channels_last = false;  ///< 1 x height x width x 3 instead of 1 x 3 x height x width.
  bool bgr = false;            ///< Blue first instead of red first.
  std::array<float, 3> scale = {1.0F / 255, 1.0F / 255, 1.0F / 255};
  std::array<float, 3> offset = {0, 0, 0};
};

/// Placement of an image in a network's input: scaled with constant aspect ratio, centered, the
/// rest filled with gray (114). Pixel centers are at integers in both.
struct Letterbox {
  double scale = 1;  ///< Scale [input pixels per image pixel].
  /// Padding left of and above the image [input pixels]; whole numbers.
  double pad_x = 0, pad_y = 0;
  cv::Size image, input;  ///< Sizes [pixels].
  cv::Size inner;         ///< Size of the image in the input [pixels].

  Letterbox(cv::Size image_size, cv::Size input_size);
  /// Returns a placement without padding, with another aspect ratio than the image's.
  static Letterbox stretched(cv::Size image_size, cv::Size input_size);
  /// Returns a placement in the upper left corner: all padding is on the right and below.
  static Letterbox in_corner(cv::Size image_size, cv::Size input_size);

  /// Returns the image position of an input position (edge coordinates: pixel i covers i to i + 1).
  cv::Point2f to_image(cv::Point2f input_edge) const;
  /// Returns the input position of an image position (edge coordinates).
  cv::Point2f to_input(cv::Point2f image_edge) const;

  /// Computes the network input. `color` is 8UC3 BGR of size `image`; `values` has three times the
  /// area of `input`.
  void fill(const cv::Mat& color, std::span<float> values, const PixelFormat& format = {}) const;
};

}  // namespace stillmap
