// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

#include <cstdint>
#include <map>
#include <optional>

namespace stillmap {

/// A pose relative to a keyframe of the map, with which it moves.
struct RelativePlace {
  KeyframeId keyframe;
  Pose T_keyframe_camera;
};

/// Returns the place relative to a keyframe that is still in the map; none if its map was dropped.
inline std::optional<RelativePlace> current_place(const Map& map, const RelativePlace& place) {
  const KeyframeId current = map.current_keyframe(place.keyframe);
  if (!current.valid()) return std::nullopt;
  if (current == place.keyframe) return place;
  const Pose T_world_camera = map.resolve(place.keyframe, place.T_keyframe_camera);
  return RelativePlace{current, map.at(current).T_world_camera.inverse() * T_world_camera};
}

/// Returns the positions of the keyframes in the list of Map::content().
inline std::map<KeyframeId, std::uint32_t> positions_in_content(const Map& map) {
  std::map<KeyframeId, std::uint32_t> positions;
  map.for_each_keyframe([&](const Keyframe& k) {
    positions.emplace(k.id, static_cast<std::uint32_t>(positions.size()));
  });
  return positions;
}

}  // namespace stillmap
