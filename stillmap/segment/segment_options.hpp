// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Where instances come from, and how a network is run. At most one of `model` and `masks`; neither
/// means that there is no detector, which is fine.
struct SegmentOptions {
  std::string model;  ///< YOLOv7, YOLOv8 or YOLO11 network, detect or segment (.onnx)
  std::string masks;  ///< folder with one 8-bit PNG per frame, made offline
  std::string backend =
      "auto";                ///< auto, openvino or opencv; auto takes OpenVINO if it is installed
  int threads = 1;           ///< threads of the network; the opencv back end uses OpenCV's own pool
  float confidence = 0.25F;  ///< detections below are dropped, 0 to 1
  float iou = 0.7F;          ///< of two boxes of one class that overlap more, the weaker is dropped
  int max_instances = 100;   ///< per frame, the most confident ones
  std::vector<std::string> classes;  ///< names of the classes to report; empty for all
  STILLMAP_FIELDS(model, masks, backend, threads, confidence, iou, max_instances, classes)
};

}  // namespace stillmap
