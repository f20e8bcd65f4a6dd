// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace stillmap {

/// Source of instances and parameters of the network. At most one of `model` and `masks` may be
/// set; without both there is no detector.
struct SegmentOptions {
  std::string model;  ///< YOLOv7, YOLOv8 or YOLO11 network for detection or segmentation (.onnx).
  std::string masks;  ///< Folder with one 8-bit PNG per frame.
  /// Inference back end: auto, openvino or opencv; auto uses OpenVINO if it is installed.
  std::string backend = "auto";
  /// Number of threads of the network; the back end opencv uses OpenCV's own pool.
  int threads = 1;
  float confidence = 0.25F;  ///< Minimum confidence of a detection [0..1].
  /// IoU of two boxes of one class above which the less confident is dropped [0..1].
  float iou = 0.7F;
};

}  // namespace stillmap
