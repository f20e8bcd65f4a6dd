// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/make_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/segment/mask_folder.hpp"
#include "stillmap/segment/yolo_detector.hpp"

namespace stillmap {

std::unique_ptr<Detector> make_detector(const SegmentOptions& options) {
  if (!options.model.empty() && !options.masks.empty()) {
    throw Error("both a network and a folder of masks are given", "segment.model, segment.masks",
                "give one of them");
  }
  if (!options.model.empty()) return std::make_unique<YoloDetector>(options);
  if (!options.masks.empty()) return std::make_unique<MaskFolder>(options.masks);
  return nullptr;
}

}  // namespace stillmap
