// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor.hpp"

#include "stillmap/dense/synthetic_room.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

TEST(Floor, FindsTheFloor) {
  const PlannerMaps m = planner_maps();
  EXPECT_LT((m.floor.up - Eigen::Vector3d(0, -1, 0)).norm(), 5e-3);
  EXPECT_NEAR(m.floor.height, -kFloorY, 5e-3);
  EXPECT_GT(m.floor.points, 1000U);
}

TEST(Floor, FindsNoFloorInAWall) {
  std::vector<Eigen::Vector3f> wall;
  for (int i = 0; i < 10000; ++i) {
    wall.emplace_back(0.01F * static_cast<float>(i % 100), 0.01F * static_cast<float>(i / 100), 2);
  }
  const auto floor = find_floor(wall, {0, -1, 0});
  // At most the lowest strip of the wall may be found.
  EXPECT_LT(floor ? floor->points : 0, 800U);
  EXPECT_FALSE(find_floor({}, {0, -1, 0}));
}

TEST(Floor, MapFrameIsOnTheFloorBelowTheCamera) {
  const PlannerMaps m = planner_maps();
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(0, 0, 0) - Eigen::Vector3d(0, 0, kFloorY)).norm(),
            0.01);
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(0, kFloorY, 2) - Eigen::Vector3d(2, 0, 0)).norm(),
            0.01);
  EXPECT_LT((m.T_map_world * Eigen::Vector3d(1, kFloorY, 0) - Eigen::Vector3d(0, -1, 0)).norm(),
            0.01);
}

}  // namespace
}  // namespace stillmap
