// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/saved_views.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/fnv1a.hpp"

#include <algorithm>

namespace stillmap {

void require_views(const SavedMap& saved, const std::string& where) {
  if (!saved.views.empty()) return;
  throw Error("contains no dense map: it was saved with --slim-map", where,
              "save the map without --slim-map");
}

std::uint64_t image_hash(const DenseView& view) {
  std::uint64_t hash = fnv1a("");
  for (int row = 0; row < view.color.rows; ++row) {
    const auto* color = reinterpret_cast<const char*>(view.color.ptr(row));
    hash = fnv1a({color, view.color.cols * view.color.elemSize()}, hash);
  }
  view.drop_pages();
  return hash;
}

ViewPoses largest_of(const std::map<std::uint32_t, ViewPoses>& by_component) {
  const auto smaller = [](const auto& a, const auto& b) {
    return a.second.size() < b.second.size();
  };
  const auto largest = std::max_element(by_component.begin(), by_component.end(), smaller);
  return largest == by_component.end() ? ViewPoses() : largest->second;
}

std::uint32_t component_of(const MapContent& map, const Landmark& landmark) {
  return map.keyframes[landmark.observations.front().keyframe.slot].component;
}

std::uint32_t main_component(const SavedMap& saved) {
  std::map<std::uint32_t, std::size_t> sizes;
  for (const AnchoredView& view : saved.views)
    ++sizes[saved.map.keyframes[view.anchor.slot].component];
  if (sizes.empty()) {
    for (const Keyframe& keyframe : saved.map.keyframes) ++sizes[keyframe.component];
  }
  const auto largest =
      std::ranges::max_element(sizes, {}, [](const auto& component) { return component.second; });
  return largest == sizes.end() ? 0 : largest->first;
}

ViewPoses view_poses(const SavedMap& saved) {
  const std::uint32_t component = main_component(saved);
  ViewPoses poses;
  for (std::size_t id = 0; id < saved.views.size(); ++id) {
    const AnchoredView& view = saved.views[id];
    const Keyframe& anchor = saved.map.keyframes[view.anchor.slot];
    if (anchor.component == component) poses[id] = anchor.T_world_camera * view.T_anchor_camera;
  }
  return poses;
}

PlacedMap place_views(const SavedMap& saved, const DenseOptions& options) {
  DenseMap dense(saved.map.camera, options);
  for (std::size_t id = 0; id < saved.views.size(); ++id) dense.add(id, saved.views[id].view);
  const ViewPoses poses = view_poses(saved);
  return dense.place(pose_lookup(poses));
}

}  // namespace stillmap
