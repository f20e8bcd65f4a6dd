// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor_plan.hpp"

#include "stillmap/dense/synthetic_room.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

// Returns the value of the grid at a point of frame `map` [m].
int value_at(const OccupancyGrid& grid, double x, double y) {
  const int col = static_cast<int>(std::floor((x - grid.origin.x()) / grid.resolution));
  const int row =
      grid.image.rows - 1 - static_cast<int>(std::floor((y - grid.origin.y()) / grid.resolution));
  const bool inside = row >= 0 && col >= 0 && row < grid.image.rows && col < grid.image.cols;
  return inside ? grid.image(row, col) : 205;
}

TEST(FloorPlan, DistinguishesOccupiedFreeAndUnknown) {
  const OccupancyGrid grid = planner_maps().grid;
  EXPECT_EQ(value_at(grid, 2.02, 0.0), 0);    // the box's front
  EXPECT_EQ(value_at(grid, 3.02, 0.6), 0);    // the wall
  EXPECT_EQ(value_at(grid, 1.5, 0.0), 254);   // floor in front of the box
  EXPECT_EQ(value_at(grid, 1.8, 0.6), 254);   // floor next to the box
  EXPECT_EQ(value_at(grid, 4.0, 0.0), 205);   // behind the wall
  EXPECT_EQ(value_at(grid, -1.0, 0.0), 205);  // behind the camera
}

}  // namespace
}  // namespace stillmap
