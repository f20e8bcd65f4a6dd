// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/tag_landmarks.hpp"

#include "stillmap/map/test_tag_views.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::tag_camera;

constexpr TagName kTag{0, 0};

/// Adds a keyframe that sees a tag 2 m in front of the world's origin, shifted by some pixels.
KeyframeId add_view(Map& map, std::uint32_t component, const Pose& T_world_camera, float shift) {
  return test::add_tag_view(map, component, T_world_camera, {{0, 0, 2}}, shift);
}

void add_landmarks(Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.at(id);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const Keypoint& k = keyframe.features->keypoints[i];
    map.add_landmark(keyframe.T_world_camera * map.camera().unproject(k.u, k.v, k.depth), {id, i});
  }
}

TEST(TagLandmarks, AreObservedAgainFromAnyDistance) {
  Map map(tag_camera(), {});
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
  Map map(tag_camera(), {});
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
