// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/pipeline/saved_map.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace stillmap {

/// T_world_camera of views of the dense map, by their ids.
using ViewPoses = std::map<std::uint64_t, Pose>;

/// Throws Error for a map without views of the dense map.
/// @param where  name of the map, for messages
void require_views(const SavedMap& saved, const std::string& where);

/// Returns a hash of the image of a view, by which it is recognized in several maps. Later visits
/// may have removed surfaces from one of them.
std::uint64_t image_hash(const DenseView& view);

/// Returns the poses of the component with most views, the first of equals. The views of the other
/// components have other worlds, so they cannot be fused with these.
ViewPoses largest_of(const std::map<std::uint32_t, ViewPoses>& by_component);

/// Returns the component that a landmark belongs to.
std::uint32_t component_of(const MapContent& map, const Landmark& landmark);

/// Returns the component of a saved map that is shown, exported and aligned: that with most views,
/// without views that with most keyframes; of equals the first. 0 for an empty map.
std::uint32_t main_component(const SavedMap& saved);

/// Returns the poses of the views in the main component of a saved map, by their index in its list.
ViewPoses view_poses(const SavedMap& saved);

/// Returns the dense map of the saved views. With the options of the run that saved them it is
/// identical to the run's own map, bit for bit.
PlacedMap place_views(const SavedMap& saved, const DenseOptions& options = {});

}  // namespace stillmap
