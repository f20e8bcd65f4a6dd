// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/segment_options.hpp"
#include "stillmap/segment/yolo_decoder.hpp"

#include <memory>
#include <string>
#include <vector>

namespace stillmap {

/// A YOLOv7, YOLOv8 or YOLO11 network, detect or segment (which it is, the file says), on one of
/// the back ends. Class names come from the file's metadata; where it has none, 80 classes are
/// taken to be COCO's.
class YoloDetector final : public Detector {
 public:
  /// Loads `options.model` and runs it once. Throws Error if the file is missing, no network, or
  /// one of another kind; if the back end is not there; if an option makes no sense.
  explicit YoloDetector(const SegmentOptions& options);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  std::string description() const override;
  const std::vector<std::string>& class_names() const override { return class_names_; }

  /// Pixels of the network's input.
  cv::Size input_size() const;
  /// Whether it gives masks, or only boxes.
  bool segments() const { return shape_.mask_coefficients > 0; }

 private:
  void check_outputs(const OnnxInfo& info);

  SegmentOptions options_;
  std::vector<std::string> class_names_;
  std::unique_ptr<InferenceEngine> engine_;
  YoloShape shape_;
  DecodeOptions decode_;
  std::vector<float> input_;
};

}  // namespace stillmap
