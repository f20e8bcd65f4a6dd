// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"

#include <memory>
#include <vector>

namespace stillmap {

/// Views with their poses, and the owners of their pixels.
struct FusedViews {
  std::vector<PosedView> views;
  std::vector<std::shared_ptr<const DenseView>> held;
};

/// Averages the static depths of each view with those that its nearest views measured of the same
/// surfaces, so that all views agree on the surfaces. The rest of the views stays as it is.
/// @param memory  views beyond it are kept in a file
FusedViews fused_views(const std::vector<PosedView>& views, const MemoryLimit& memory);

}  // namespace stillmap
