// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/network_detector.hpp"
#include "stillmap/segment/small_frame.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Splits the mask of one class into objects by depth. Pixels on one surface (depths of neighbors
/// differ by less than 6 cm at 2 m, more with the square of the depth) are one piece; pieces that
/// touch are one object if their median depths differ by less than 0.5 m, as those of a body and an
/// arm, or if one is less than a quarter of the other. Pixels without depth go to the nearest
/// piece.
/// @param mask   not 0 on the class
/// @param depth  of the mask's size [m]; 0: unknown
/// @return the objects, of the mask's size, by descending size
std::vector<cv::Mat1b> split_by_depth(const cv::Mat1b& mask, const cv::Mat1f& depth);

/// A network for semantic segmentation, which gives each pixel a class but tells no objects apart:
/// DeepLabV3 as published for TensorFlow, with the input 1 x height x width x 3 (RGB, -1 to 1) and
/// one output 1 x height x width x classes. Class 0 is the background. Without class names in the
/// metadata, 21 classes are assumed to be those of Pascal VOC.
class SemanticDetector final : public NetworkDetector {
 public:
  /// Returns whether input and outputs are those of such a network.
  static bool fits(const Network& network);
  /// Throws Error if the number of classes is not that of the class names.
  explicit SemanticDetector(Network network);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
};

}  // namespace stillmap
