// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/segment_options.hpp"

#include <memory>

namespace stillmap {

/// Returns the detector selected by the options; null if they select neither a network nor a folder
/// of masks. Throws Error if they select both, or if the selected one is unusable.
std::unique_ptr<Detector> make_detector(const SegmentOptions& options);

}  // namespace stillmap
