// SPDX-License-Identifier: Apache-2.0
// The content of the seeds of saved maps and journals.
#pragma once
#include "stillmap/pipeline/saved_map.hpp"

#include <memory>
#include <vector>

namespace stillmap::fuzz {

/// Returns two keyframes with a common landmark.
inline Map small_map() {
  Camera camera;
  camera.width = 64, camera.height = 48;
  Map map(camera, PyramidShape{8, 1.2});
  std::vector<KeyframeId> ids;
  for (std::uint64_t i = 0; i < 2; ++i) {
    auto features = std::make_shared<Features>();
    features->keypoints = {{.u = 3, .v = 4, .depth = 2}, {.u = 30, .v = 40, .level = 1}};
    features->descriptors = {{1, 2, 3, i}, {4, 5, 6, i}};
    features->grid = KeypointGrid(features->keypoints, 64, 48);
    Keyframe keyframe;
    keyframe.static_weight = {1, 0.5F};
    keyframe.features = features;
    keyframe.frame_index = i;
    ids.push_back(map.add_keyframe(std::move(keyframe)).id);
  }
  const LandmarkId landmark = map.add_landmark({0, 0, 2}, {ids[0], 0}).id;
  map.observe(landmark, {ids[1], 0});
  map.refresh(landmark);
  return map;
}

inline AnchoredView small_view() {
  AnchoredView anchored{.anchor = {0, 0}, .T_anchor_camera = {}, .view = {}};
  DenseView& view = anchored.view;
  view.camera.width = 4, view.camera.height = 3;
  view.depth = cv::Mat1w(3, 4, std::uint16_t{10000});
  view.color = cv::Mat3b(3, 4, cv::Vec3b(1, 2, 3));
  view.kind = cv::Mat1b(3, 4, std::uint8_t{kFirstInstance});
  view.instances = {{"chair", 0.5F}};
  return anchored;
}

}  // namespace stillmap::fuzz
