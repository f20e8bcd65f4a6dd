// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/pipeline/saved_map.hpp"

#include <cstdint>
#include <map>

namespace stillmap {

/// T_world_camera of views of the dense map, by their ids.
using ViewPoses = std::map<std::uint64_t, Pose>;

/// Of unconnected maps the one with most views, the first of equals: the others have worlds of
/// their own, and must not be held against it.
ViewPoses largest_of(const std::map<std::uint32_t, ViewPoses>& by_component);

/// Where the views of a saved map are, by their place in its list: those of its largest component.
ViewPoses view_poses(const SavedMap& saved);

/// The views of a saved map put together. With the options of the run that saved it this is the
/// run's own map, to the last bit.
PlacedMap place_views(const SavedMap& saved, const DenseOptions& options = {});

}  // namespace stillmap
