// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/network_detector.hpp"
#include "stillmap/segment/yolo_decoder.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A YOLO network (v7, v8, 11, X and others, see recognize_yolo()) for detection or segmentation.
/// Class names are read from the metadata; without them, 80 classes are assumed to be COCO's.
class YoloDetector final : public NetworkDetector {
 public:
  /// Throws Error if the outputs are not those of such a network.
  explicit YoloDetector(Network network);
  explicit YoloDetector(const SegmentOptions& options) : YoloDetector(Network(options)) {}

  std::vector<Instance> detect(const RgbdFrame& frame) override;

  /// Returns the detections before their boxes are widened to whole pixels: boxes in the network's
  /// input, see Letterbox. `color` is 8UC3 BGR.
  std::vector<Candidate> detect_candidates(const cv::Mat& color);

  /// Returns the size of the network's input [pixels].
  cv::Size input_size() const { return network_.input_size(); }
  /// Returns whether the network computes masks, not only boxes.
  bool segments() const { return shape_.mask_coefficients > 0; }
  bool gives_masks() const override { return segments(); }

 private:
  PixelFormat format_;
  YoloShape shape_;
  DecodeOptions decode_;
};

}  // namespace stillmap
