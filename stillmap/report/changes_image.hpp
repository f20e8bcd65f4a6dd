// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/map_changes.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns a picture of both maps beside each other from the same viewpoint, 8UC3 BGR: the earlier
/// one with what went and moved, the later one with what appeared and moved, in ChangeColors.
cv::Mat draw_changes(const MapChanges& changes);

}  // namespace stillmap
