// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/moving_background.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Keypoints of a person in the middle of the image and of a wall around.
struct PersonBeforeAWall {
  Features features;
  std::vector<float> of_person, of_wall;  // weights if these move

  explicit PersonBeforeAWall(float person_depth = 1, float wall_depth = 3) {
    for (float v = 10; v < 480; v += 20) {
      for (float u = 10; u < 640; u += 20) {
        const bool person = u > 200 && u < 440 && v > 40;
        features.keypoints.push_back(
            Keypoint{.u = u, .v = v, .depth = person ? person_depth : wall_depth});
        of_person.push_back(person ? 0 : 1);
        of_wall.push_back(person ? 1 : 0);
      }
    }
  }
};

TEST(MovingBackground, IsFartherThanWhatSeemsStaticAndOnThreeSides) {
  const PersonBeforeAWall view;
  EXPECT_TRUE(background_moves(view.features, view.of_wall));
  EXPECT_FALSE(background_moves(view.features, view.of_person));
  EXPECT_FALSE(background_moves(view.features, std::vector<float>(view.features.size(), 1)));
  EXPECT_FALSE(background_moves(view.features, std::vector<float>(view.features.size(), 0)));
  EXPECT_FALSE(background_moves(view.features, {}));
}

TEST(MovingBackground, IsNotThatOfAnObjectFartherAway) {
  const PersonBeforeAWall hole(3, 1);  // what moves is nearer
  EXPECT_FALSE(background_moves(hole.features, hole.of_wall));
  const PersonBeforeAWall unknown(0, 3);
  EXPECT_FALSE(background_moves(unknown.features, unknown.of_wall));
}

TEST(MovingBackground, IsNotOnOneSideOnly) {
  // People behind a table, which is the lower half of the image.
  Features features;
  std::vector<float> weight;
  for (float v = 10; v < 480; v += 20) {
    for (float u = 10; u < 640; u += 20) {
      features.keypoints.push_back(Keypoint{.u = u, .v = v, .depth = v > 240 ? 1.0F : 3.0F});
      weight.push_back(v > 240 ? 1 : 0);
    }
  }
  EXPECT_FALSE(background_moves(features, weight));
}

}  // namespace
}  // namespace stillmap
