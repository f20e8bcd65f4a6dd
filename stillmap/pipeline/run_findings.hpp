// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/run_details.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Returns the findings about the results of a run: few frames with a pose, many unusable or late
/// frames, unconnected maps, an empty dense map, many uncertain poses, missing or unlikely masks, a
/// network without masks for a preset that needs them, and intrinsics that the map contradicts.
std::vector<Finding> run_findings(const RunDetails& run);

}  // namespace stillmap
