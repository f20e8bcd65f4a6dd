// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/zone_view.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// A square of one meter, 3 m ahead of a level camera that is 1 m above the floor y = 1.
Zone square() {
  return {.name = "gate",
          .polygon = {{-0.5, 1, 2.5}, {0.5, 1, 2.5}, {0.5, 1, 3.5}, {-0.5, 1, 3.5}},
          .classes = {}};
}

double seen_with_depth(float depth, const Pose& pose = Pose()) {
  const Camera camera;
  return seen_share(square(), camera, pose, cv::Mat1f(camera.height, camera.width, depth));
}

TEST(ZoneView, AZoneInFrontOfAWallIsSeen) { EXPECT_EQ(seen_with_depth(5), 1); }

TEST(ZoneView, AZoneBehindAWallOrWithoutDepthIsNot) {
  EXPECT_EQ(seen_with_depth(2), 0);
  EXPECT_EQ(seen_with_depth(0), 0);
}

TEST(ZoneView, AWallInTheMiddleHidesTheFarHalf) { EXPECT_NEAR(seen_with_depth(2.7F), 0.5, 0.01); }

TEST(ZoneView, AZoneBehindOrBesideTheCameraIsNotSeen) {
  const Eigen::AngleAxisd back(EIGEN_PI, Eigen::Vector3d::UnitY());
  EXPECT_EQ(seen_with_depth(5, Pose(Eigen::Quaterniond(back), {0, 0, 0})), 0);
  EXPECT_EQ(seen_with_depth(5, Pose(Eigen::Quaterniond::Identity(), {4, 0, 0})), 0);
  EXPECT_LT(seen_with_depth(9, Pose(Eigen::Quaterniond::Identity(), {0, 0, 3})), 0.5);
}

}  // namespace
}  // namespace stillmap
