// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/tag_landmarks.hpp"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr TagName kTag{0, 7};

Camera camera() {
  Camera c;
  c.width = 640, c.height = 480;
  c.fx = c.fy = 500, c.cx = 320, c.cy = 240;
  c.baseline = 0.08;
  return c;
}

/// Adds a keyframe that sees the corners of a tag of side 0.2 m, 2 m in front of the world's
/// origin, shifted by some pixels.
KeyframeId add_view(Map& map, std::uint32_t component, const Pose& T_world_camera, float shift) {
  auto features = std::make_shared<Features>();
  for (std::uint8_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d p_world(i == 1 || i == 2 ? 0.1 : -0.1, i < 2 ? 0.1 : -0.1, 2);
    const Eigen::Vector3d p = T_world_camera.inverse() * p_world;
    const Eigen::Vector2d uv = map.camera().project(p);
    features->keypoints.push_back({.u = static_cast<float>(uv.x()) + shift,
                                   .v = static_cast<float>(uv.y()),
                                   .depth = static_cast<float>(p.z())});
    features->descriptors.push_back(descriptor_of({kTag, i}));
  }
  Keyframe keyframe;
  keyframe.component = component;
  keyframe.T_world_camera = T_world_camera;
  keyframe.static_weight.assign(4, 1);
  keyframe.landmarks.resize(4);
  keyframe.features = std::move(features);
  return map.add_keyframe(std::move(keyframe)).id;
}

void add_landmarks(Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.at(id);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const Keypoint& k = keyframe.features->keypoints[i];
    map.add_landmark(keyframe.T_world_camera * map.camera().unproject(k.u, k.v, k.depth), {id, i});
  }
}

TEST(TagLandmarks, AreObservedAgainFromAnyDistance) {
  Map map(camera(), {});
  const std::uint32_t component = map.new_component();
  const KeyframeId first = add_view(map, component, Pose(), 0);
  add_landmarks(map, first);
  for (const double z : {1.5, -10.0}) {  // a quarter of the distance, and six times as far
    const KeyframeId other =
        add_view(map, component, Pose(Eigen::Quaterniond::Identity(), {0.05, 0, z}), 2);
    observe_tags(map, other);
    EXPECT_EQ(map.at(other).landmarks, map.at(first).landmarks) << z;
  }
  const Landmark& corner = map.at(map.at(first).landmarks[0]);
  EXPECT_EQ(corner.observations.size(), 3U);
  EXPECT_EQ(corner.max_distance, 0) << "any distance";
  EXPECT_EQ(expected_level({}, corner.max_distance, 5), 0);
}

TEST(TagLandmarks, AreNotObservedAcrossDriftAndComponents) {
  Map map(camera(), {});
  const std::uint32_t component = map.new_component();
  add_landmarks(map, add_view(map, component, Pose(), 0));
  const KeyframeId drifted = add_view(map, component, Pose(), 10);
  const KeyframeId elsewhere = add_view(map, map.new_component(), Pose(), 0);
  for (const KeyframeId id : {drifted, elsewhere}) {
    observe_tags(map, id);
    for (const LandmarkId landmark : map.at(id).landmarks) EXPECT_FALSE(landmark.valid());
  }
}

TEST(TagLandmarks, OfOneCornerTheMostObservedCounts) {
  std::vector<Landmark> landmarks(6);
  for (std::uint8_t i = 0; i < 4; ++i) landmarks[i].descriptor = descriptor_of({kTag, i});
  landmarks[4].descriptor = landmarks[2].descriptor;
  landmarks[4].observations.resize(2);
  landmarks[5].descriptor = descriptor_of({{0, 8}, 0});
  std::vector<const Landmark*> all;
  for (const Landmark& landmark : landmarks) all.push_back(&landmark);
  const auto tags = tags_among(all);
  ASSERT_EQ(tags.size(), 1U) << "tag 8 has one corner";
  EXPECT_EQ(tags.begin()->first, kTag);
  EXPECT_EQ(tags.begin()->second, (TagLandmarks{all[0], all[1], all[4], all[3]}));
}

}  // namespace
}  // namespace stillmap
