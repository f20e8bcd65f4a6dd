// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"

#include <memory>
#include <string>

namespace stillmap {

struct SegmentOptions;

/// Makes the detector that a text names: a network (a file NAME.onnx) or a folder with one mask per
/// frame. Throws Error that lists the known forms for any other text, and if it cannot be used.
std::unique_ptr<Detector> make_detector(const std::string& text);

/// Returns the detector selected by the options; null if they select neither a network nor a folder
/// of masks. Throws Error if they select both, or if the selected one is unusable.
std::unique_ptr<Detector> make_detector(const SegmentOptions& options);

}  // namespace stillmap
