// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace stillmap {

/// Source of instances and parameters of the network. At most one of `model` and `masks` may be
/// set; without both there is no detector.
struct SegmentOptions {
  /// Network (.onnx): YOLO, RF-DETR or RTMDet for detection or segmentation, or DeepLabV3.
  std::string model;
  std::string masks;  ///< Folder with one 8-bit PNG per frame.
  /// Inference library: auto, openvino, onnxruntime or opencv; auto uses the fastest installed one.
  std::string backend = "auto";
  /// Device: auto, tensorrt, cuda, intel-gpu, npu or cpu; auto uses the first one that works.
  std::string device = "auto";
  /// Number of threads of the network; the back end opencv uses OpenCV's own pool.
  int threads = 1;
  float confidence = 0.25F;  ///< Minimum confidence of a detection [0..1].
  /// IoU of two boxes of one class above which the less confident is dropped [0..1].
  float iou = 0.7F;
};

}  // namespace stillmap
