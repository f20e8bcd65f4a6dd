// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/camera_change.hpp"

#include <memory>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns a map of one keyframe with a keypoint at a level, which shows a landmark.
MapContent map_with_keypoint(int level) {
  Camera camera;
  camera.width = 320, camera.height = 240;
  camera.fx = camera.fy = 250, camera.cx = 160, camera.cy = 120;
  Map map(camera, PyramidShape{});
  auto features = std::make_shared<Features>();
  features->keypoints.push_back(
      {.u = 260, .v = 70, .angle = 1, .depth = 2, .level = static_cast<std::uint8_t>(level)});
  features->descriptors.push_back({1, 2, 3, 4});
  Keyframe keyframe;
  keyframe.static_weight = {1};
  keyframe.features = features;
  const KeyframeId id = map.add_keyframe(keyframe).id;
  map.add_landmark(camera.unproject(260, 70, 2), {id, 0});
  return map.content();
}

Camera longer_camera() {
  Camera camera;
  camera.width = 640, camera.height = 480;
  camera.fx = 250 * 1.44, camera.fy = 300, camera.cx = 300, camera.cy = 200;
  return camera;
}

TEST(CameraChange, KeypointsMoveToThePixelsAndLevelsOfTheOtherCamera) {
  const MapContent changed = with_camera(map_with_keypoint(3), longer_camera());
  const Keypoint& keypoint = changed.keyframes[0].features->keypoints[0];
  EXPECT_NEAR(keypoint.u, 300 + 1.44 * 100, 1e-3);
  EXPECT_NEAR(keypoint.v, 200 - 1.2 * 50, 1e-3);
  EXPECT_EQ(keypoint.level, 5) << "1.44 is two levels";
  EXPECT_EQ(keypoint.depth, 2);
  EXPECT_EQ(keypoint.angle, 1);
  EXPECT_EQ(changed.keyframes[0].features->descriptors[0], (Descriptor{1, 2, 3, 4}));
  int near = 0;
  changed.keyframes[0].features->grid.for_each_near(444, 140, 1, 0, 7, [&](auto) { ++near; });
  EXPECT_EQ(near, 1);
  EXPECT_EQ(changed.camera.width, 640);
}

TEST(CameraChange, LevelsStayWithinThePyramid) {
  const MapContent changed = with_camera(map_with_keypoint(7), longer_camera());
  EXPECT_EQ(changed.keyframes[0].features->keypoints[0].level, 7);
}

TEST(CameraChange, ALandmarkIsExpectedAtTheLevelOfItsKeypoint) {
  const MapContent changed = with_camera(map_with_keypoint(3), longer_camera());
  const Landmark& landmark = changed.landmarks[0];
  EXPECT_EQ(expected_level(changed.pyramid, landmark.max_distance, landmark.p_world.norm()), 5);
}

TEST(CameraChange, CamerasDifferByTheirImagesNotByTheirDistortion) {
  const Camera camera = longer_camera();
  Camera other = camera;
  other.distortion[0] = 0.1;
  other.depth_factor = 1000;
  EXPECT_TRUE(same_images(camera, other));
  other.fx += 1;
  EXPECT_FALSE(same_images(camera, other));
  other = camera;
  other.width = 320;
  EXPECT_FALSE(same_images(camera, other));
}

}  // namespace
}  // namespace stillmap
