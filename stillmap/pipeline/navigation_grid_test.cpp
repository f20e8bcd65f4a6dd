// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/test_error.hpp"
#include "stillmap/slam.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing::HasSubstr;

/// Points in the middle of each cell of a floor of 2 x 1 m, of a wall above x = 1.5 m at 0.8 m, and
/// of a lamp above the robot at x = 0.5 m.
Cloud room() {
  Cloud cloud;
  for (int u = 0; u < 40; ++u) {
    for (int v = 0; v < 20; ++v) cloud.add({0.05F * u + 0.025F, 0.05F * v + 0.025F, 0.01F}, {});
  }
  for (int v = 0; v < 20; ++v) {
    cloud.add({1.525F, 0.05F * v + 0.025F, 0.8F}, {});
    cloud.add({0.525F, 0.05F * v + 0.025F, 2.4F}, {});
  }
  return cloud;
}

int value_at(const NavigationGrid& grid, double x, double y) {
  const Eigen::Vector2d at = (Eigen::Vector2d(x, y) - grid.origin) / grid.cell;
  return grid.cells(static_cast<int>(std::floor(at.y())), static_cast<int>(std::floor(at.x())));
}

TEST(NavigationGrid, HasFloorWallsAndTheWay) {
  const auto grid = navigation_grid(room(), {{-0.525, 0.475, 0}}, Pose(), {.radius = 0.1});
  ASSERT_TRUE(grid);
  EXPECT_EQ(value_at(*grid, 1.525, 0.5), 100);
  EXPECT_EQ(value_at(*grid, 1.0, 0.5), 0);
  EXPECT_EQ(value_at(*grid, 0.525, 0.5), 0) << "the lamp is above the robot";
  EXPECT_EQ(value_at(*grid, -0.525, 0.475), 0);
  EXPECT_EQ(value_at(*grid, -0.525, 0.575), 0) << "within the radius";
  EXPECT_EQ(value_at(*grid, -0.525, 0.775), -1);
}

TEST(NavigationGrid, KnowsTheDistanceOfObstacles) {
  const auto grid = navigation_grid(room(), {}, Pose());
  ASSERT_TRUE(grid);
  EXPECT_NEAR(*grid->distance_at({1.025, 0.525}), 0.5, 1e-6);
  EXPECT_NEAR(*grid->distance_at({1.04, 0.51}), 0.485, 1e-6) << "between cells";
  EXPECT_NEAR(*grid->distance_at({1.525, 0.525}), 0, 1e-6);
  EXPECT_FALSE(grid->distance_at({20, 0}));
  EXPECT_FALSE(grid->distance_at({std::numeric_limits<double>::quiet_NaN(), 0}));
  const auto empty = navigation_grid({}, {{0, 0, 0}}, Pose());
  EXPECT_TRUE(std::isinf(*empty->distance_at({0, 0}))) << "there is no obstacle";
}

TEST(NavigationGrid, LiesInTheFrameOfTheMap) {
  const Pose T_map_world(so3_exp({0, 0, std::acos(-1.0) / 2}), {10, 0, 0});
  const auto grid = navigation_grid(room(), {}, T_map_world);
  ASSERT_TRUE(grid);
  EXPECT_EQ(value_at(*grid, 10 - 0.525, 1.525), 100);
  EXPECT_EQ(value_at(*grid, 10 - 0.525, 1.025), 0);
}

TEST(NavigationGrid, RefusesWhatMakesNoGrid) {
  const auto error = [](const NavigationGridOptions& options) {
    return test::error_of([&] { navigation_grid(room(), {}, Pose(), options); });
  };
  EXPECT_FALSE(navigation_grid({}, {}, Pose()));
  EXPECT_THAT(test::error_of([] {
                navigation_grid(room(), {{0, std::nan(""), 0}}, Pose());
              }),
              HasSubstr("not finite"));
  EXPECT_THAT(error({.cell = 0}), HasSubstr("side of a cell"));
  EXPECT_THAT(error({.lowest = 2}), HasSubstr("exchange them"));
  EXPECT_THAT(error({.radius = -1}), HasSubstr("radius"));
  EXPECT_THAT(error({.cell = 1e-5}), HasSubstr("too many cells"));
}

}  // namespace
}  // namespace stillmap
