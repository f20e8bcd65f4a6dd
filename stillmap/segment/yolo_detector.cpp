// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/yolo_detector.hpp"

#include "stillmap/segment/coco.hpp"

namespace stillmap {
namespace {

std::vector<std::string> numbered_names(int classes) {
  std::vector<std::string> names;
  for (int c = 0; c < classes; ++c) names.push_back("class " + std::to_string(c));
  return names;
}

}  // namespace

YoloDetector::YoloDetector(Network network)
    : NetworkDetector(std::move(network)),
      decode_{.confidence = network_.options().confidence, .iou = network_.options().iou} {
  const std::string& file = network_.options().model;
  format_.channels_last = network_.channels_last();
  shape_ = recognize_yolo(network_.output_shapes(), static_cast<int>(class_names_.size()), file,
                          input_size());
  if (!shape_.cells.empty()) {  // YOLOX
    format_.bgr = true;
    format_.scale = {1, 1, 1};
    leave_decoded(network_.outputs()[shape_.boxes_output], input_size(), shape_);
  }
  if (class_names_.empty()) {
    class_names_ = shape_.classes == 80 ? coco_class_names() : numbered_names(shape_.classes);
  }
}

std::vector<Candidate> YoloDetector::detect_candidates(const cv::Mat& color) {
  const Letterbox letterbox(color.size(), input_size());
  return decode_candidates(network_.run_on(color, letterbox, format_), shape_, decode_);
}

std::vector<Instance> YoloDetector::detect(const RgbdFrame& frame) {
  const Letterbox letterbox(frame.color.size(), input_size());
  return decode_yolo(network_.run_on(frame.color, letterbox, format_), shape_, letterbox, decode_,
                     class_names_);
}

}  // namespace stillmap
