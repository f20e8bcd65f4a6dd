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

/// A YOLOv7, YOLOv8 or YOLO11 network for detection or segmentation on one of the back ends. Class
/// names are read from the metadata; without them, 80 classes are assumed to be COCO's.
class YoloDetector final : public Detector {
 public:
  /// Loads `options.model` and runs it once. Throws Error if the file is missing, not a network, or
  /// of another kind; if the back end is not available; or if an option is invalid.
  explicit YoloDetector(const SegmentOptions& options);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  std::string description() const override;
  std::optional<InferenceInfo> inference() const override;
  bool immediate() const override {
    return engine_.device == "tensorrt" || engine_.device == "cuda";
  }
  const std::vector<std::string>& class_names() const override { return class_names_; }

  /// Returns the detections before their boxes are widened to whole pixels: boxes in the network's
  /// input, see Letterbox. `color` is 8UC3 BGR.
  std::vector<Candidate> detect_candidates(const cv::Mat& color);

  /// Returns the size of the network's input [pixels].
  cv::Size input_size() const;
  /// Returns whether the network computes masks, not only boxes.
  bool segments() const { return shape_.mask_coefficients > 0; }
  bool gives_masks() const override { return segments(); }

 private:
  void check_outputs(const OnnxInfo& info);
  std::vector<TensorView> run_on(const cv::Mat& color, const Letterbox& letterbox);

  SegmentOptions options_;
  std::vector<std::string> class_names_;
  ChosenEngine engine_;
  YoloShape shape_;
  DecodeOptions decode_;
};

}  // namespace stillmap
