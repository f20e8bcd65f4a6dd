// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/make_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/segment/mask_folder.hpp"
#include "stillmap/segment/yolo_detector.hpp"

#include <filesystem>

namespace stillmap {

std::unique_ptr<Detector> make_detector(const std::string& text) {
  SegmentOptions options;
  if (text.ends_with(".onnx")) {
    options.model = text;
  } else if (std::filesystem::is_directory(text)) {
    options.masks = text;
  } else {
    throw Error("'" + text + "' is neither a network nor a folder", "make_detector",
                "name a YOLOv7, YOLOv8 or YOLO11 network (FILE.onnx), or a folder of masks");
  }
  return make_detector(options);
}

std::unique_ptr<Detector> make_detector(const SegmentOptions& options) {
  if (!options.model.empty() && !options.masks.empty()) {
    throw Error("both a network and a folder of masks are given", "network.model, network.masks",
                "give one of them");
  }
  if (!options.model.empty()) return std::make_unique<YoloDetector>(options);
  if (!options.masks.empty()) return std::make_unique<MaskFolder>(options.masks);
  return nullptr;
}

}  // namespace stillmap
