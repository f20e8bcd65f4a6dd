// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/segment_options.hpp"

#include <memory>

namespace stillmap {

/// The detector that the options ask for; null if they name neither a network nor a folder of
/// masks. Throws Error if they name both, or if what they name cannot be used.
std::unique_ptr<Detector> make_detector(const SegmentOptions& options);

}  // namespace stillmap
