// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/tag_corners.hpp"
#include "stillmap/map/map.hpp"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

/// Keyframes that see nothing but tags, for tests.
namespace stillmap::test {

inline Camera tag_camera() {
  Camera c;
  c.width = 640, c.height = 480;
  c.fx = c.fy = 500, c.cx = 320, c.cy = 240;
  c.baseline = 0.08;
  return c;
}

/// Returns a corner, as in Tag::corners, of a tag of side 0.2 m in a plane of constant z [m].
inline Eigen::Vector3d tag_corner(const Eigen::Vector3d& center, int corner) {
  return center +
         Eigen::Vector3d(corner == 1 || corner == 2 ? 0.1 : -0.1, corner < 2 ? 0.1 : -0.1, 0);
}

/// Adds a keyframe without landmarks that sees tags 0, 1, 2, ... at these centers [m].
/// @param shift  of the keypoints to the right [pixels]
inline KeyframeId add_tag_view(Map& map, std::uint32_t component, const Pose& T_world_camera,
                               const std::vector<Eigen::Vector3d>& centers, float shift = 0) {
  auto features = std::make_shared<Features>();
  for (std::uint32_t tag = 0; tag < centers.size(); ++tag) {
    for (std::uint8_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d p = T_world_camera.inverse() * tag_corner(centers[tag], i);
      const Eigen::Vector2d uv = map.camera().project(p);
      features->keypoints.push_back({.u = static_cast<float>(uv.x()) + shift,
                                     .v = static_cast<float>(uv.y()),
                                     .depth = static_cast<float>(p.z())});
      features->descriptors.push_back(descriptor_of({{0, tag}, i}));
    }
  }
  Keyframe keyframe;
  keyframe.component = component;
  keyframe.T_world_camera = T_world_camera;
  keyframe.static_weight.assign(features->size(), 1);
  keyframe.landmarks.resize(features->size());
  keyframe.features = std::move(features);
  return map.add_keyframe(std::move(keyframe)).id;
}

}  // namespace stillmap::test
