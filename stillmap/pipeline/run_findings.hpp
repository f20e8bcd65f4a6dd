// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/run_details.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Returns whether the paper of a preset uses masks, so that the boxes of a network are not enough.
bool needs_masks(const std::string& preset);

/// Returns whether the paper of a preset uses a network's boxes or masks.
bool needs_detector(const std::string& preset);

/// Returns the findings about the results of a run: few frames with a pose, many unusable or late
/// frames, unconnected maps, an empty dense map, many uncertain poses, missing or unlikely masks, a
/// network without masks for a preset that needs them, and intrinsics that the map contradicts.
std::vector<Finding> run_findings(const RunDetails& run);

}  // namespace stillmap
