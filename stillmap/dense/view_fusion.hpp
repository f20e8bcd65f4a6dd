// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"

#include <memory>
#include <vector>

namespace stillmap {

/// Returns the views without the smooth error of the depth sensor that they show (see
/// depth_error_of()), with static depths that are averaged over the nearest views, so that all
/// agree on the surfaces; colors and kinds of pixels do not change.
/// @param memory  views beyond it are kept in a file
std::vector<std::shared_ptr<const DenseView>> fused_views(const std::vector<PosedView>& views,
                                                          const MemoryLimit& memory);

}  // namespace stillmap
