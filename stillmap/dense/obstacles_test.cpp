// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/obstacles.hpp"

#include "stillmap/dense/synthetic_room.hpp"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

/// Returns a space of voxels of 10 cm that are occupied in the given boxes and free elsewhere
/// between 0 and 4 m, at heights from 0 to 2 m.
OccupiedSpace space_with(const std::vector<Eigen::AlignedBox3d>& boxes) {
  OccupiedSpace space{.edge = 0.1, .occupied = {}, .free = {}};
  for (int x = 0; x < 40; ++x) {
    for (int y = 0; y < 40; ++y) {
      for (int z = 0; z < 20; ++z) {
        const Voxel voxel = voxel_of({x, y, z});
        const Eigen::Vector3d center = center_of(voxel, space.edge);
        const bool inside = std::any_of(boxes.begin(), boxes.end(),
                                        [&](const auto& b) { return b.contains(center); });
        (inside ? space.occupied : space.free).push_back(voxel);
      }
    }
  }
  return space;
}

Eigen::AlignedBox3d box(double x, double y, double z, double x2, double y2, double z2) {
  return {Eigen::Vector3d(x, y, z), Eigen::Vector3d(x2, y2, z2)};
}

TEST(Obstacles, TwoWallsThatMeetAreTwoBoxesAndNoBoxOfTheRoom) {
  const auto found =
      obstacles_in(space_with({box(0, 0, 0.2, 4, 0.1, 1.7), box(0, 0, 0.2, 0.1, 4, 1.7)}), 0);
  ASSERT_EQ(found.size(), 2U);
  for (const StaticObstacle& wall : found) {
    EXPECT_NEAR(std::min(wall.size.x(), wall.size.y()), 0.1, 1e-9);
    EXPECT_NEAR(std::max(wall.size.x(), wall.size.y()), 4, 0.11);
    EXPECT_NEAR(wall.size.z(), 1.5, 1e-9);
    EXPECT_FALSE(wall.contains({2, 2, 1}));
  }
  EXPECT_NE(found[0].piece, found[1].piece);
}

TEST(Obstacles, ATableIsItsTopAndItsLegsWithTheSpaceBelowFree) {
  const auto found =
      obstacles_in(space_with({box(1, 1, 0.7, 2, 3, 0.8), box(1, 1, 0.1, 1.1, 1.1, 0.7),
                               box(1.9, 2.9, 0.1, 2, 3, 0.7)}),
                   0);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_LT((found[0].size - Eigen::Vector3d(1, 2, 0.1)).norm(), 1e-9) << "the top is the largest";
  EXPECT_LT((found[0].center - Eigen::Vector3d(1.5, 2, 0.75)).norm(), 1e-9);
  for (const StaticObstacle& part : found) {
    EXPECT_FALSE(part.contains({1.5, 2, 0.4}));
    EXPECT_EQ(part.piece, 1) << "one table";
  }
}

TEST(Obstacles, AreRotatedIntoTheFrameOfTheMap) {
  const double yaw = std::numbers::pi / 2;
  const auto found = obstacles_in(space_with({box(1, 2, 0.2, 3, 2.5, 1)}), yaw);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_LT((found[0].center - Eigen::Vector3d(-2.25, 2, 0.6)).norm(), 1e-9);
  EXPECT_TRUE(found[0].contains({-2.25, 2.9, 0.6}));
  EXPECT_FALSE(found[0].contains({-1.3, 2, 0.6}));
}

TEST(Obstacles, SmallOnesAndThoseOutsideTheBandAreLeftOut) {
  EXPECT_TRUE(obstacles_in(space_with({box(1, 1, 0.5, 1.1, 1.1, 0.6)}), 0).empty());
  EXPECT_TRUE(obstacles_in(space_with({box(1, 1, 0, 3, 3, 0.1)}), 0).empty()) << "the floor";
}

TEST(Obstacles, OfARenderedRoomCoverItsSurfacesButNoSpaceThatWasSeenToBeFree) {
  const PlannerMaps m = planner_maps();
  const auto inside = [&](Voxel voxel) {
    return std::count_if(m.obstacles.begin(), m.obstacles.end(),
                         [&](const auto& o) { return o.contains(center_of(voxel, m.space.edge)); });
  };
  for (const Voxel voxel : m.space.free) ASSERT_EQ(inside(voxel), 0);
  int covered = 0, all = 0;
  for (const Voxel voxel : m.space.occupied) {
    const double z = center_of(voxel, m.space.edge).z();
    if (z < 0.1 || z > 1.8) continue;
    ++all;
    covered += inside(voxel) > 0;
  }
  EXPECT_GT(covered, 0.95 * all);
  const auto is_box = [](const StaticObstacle& o) {
    return o.contains({2.02, 0, 0.25}) && o.size.y() < 0.6;
  };
  EXPECT_TRUE(std::any_of(m.obstacles.begin(), m.obstacles.end(), is_box));
}

}  // namespace
}  // namespace stillmap
