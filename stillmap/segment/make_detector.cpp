// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/make_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/end_to_end_detector.hpp"
#include "stillmap/segment/mask_folder.hpp"
#include "stillmap/segment/semantic_detector.hpp"
#include "stillmap/segment/yolo_detector.hpp"

#include <filesystem>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Warns of a device or back end that has no effect, since there is no network.
void warn_of_unused(const SegmentOptions& options) {
  const SegmentOptions defaults;
  const auto check = [](const char* option, const std::string& value, const std::string& unset) {
    if (value == unset) return;
    warn(fmt::format("option {} is '{}', but no network is given", option, value),
         fmt::format("give one (--model FILE.onnx), or leave {} at {}", option, unset));
  };
  check("network.device", options.device, defaults.device);
  check("network.backend", options.backend, defaults.backend);
}

std::unique_ptr<Detector> make_network_detector(const SegmentOptions& options) {
  Network network(options);
  if (EndToEndDetector::fits(network))
    return std::make_unique<EndToEndDetector>(std::move(network));
  if (SemanticDetector::fits(network))
    return std::make_unique<SemanticDetector>(std::move(network));
  return std::make_unique<YoloDetector>(std::move(network));
}

}  // namespace

std::unique_ptr<Detector> make_detector(const std::string& text) {
  SegmentOptions options;
  if (text.ends_with(".onnx")) {
    options.model = text;
  } else if (std::filesystem::is_directory(text)) {
    options.masks = text;
  } else {
    throw Error("'" + text + "' is neither a network nor a folder", "make_detector",
                "name a network (FILE.onnx) or a folder of masks");
  }
  return make_detector(options);
}

std::unique_ptr<Detector> make_detector(const SegmentOptions& options) {
  if (!options.model.empty() && !options.masks.empty()) {
    throw Error("both a network and a folder of masks are given", "network.model, network.masks",
                "give one of them");
  }
  if (!options.model.empty()) return make_network_detector(options);
  warn_of_unused(options);
  if (!options.masks.empty()) return std::make_unique<MaskFolder>(options.masks);
  return nullptr;
}

}  // namespace stillmap
