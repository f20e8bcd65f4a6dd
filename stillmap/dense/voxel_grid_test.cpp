// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/voxel_grid.hpp"

#include "stillmap/base/error.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(VoxelGrid, KeepsTheMeanOfEachVoxel) {
  VoxelGrid grid(0.1);
  grid.add({0.52, 0.03, -0.01}, {10, 0, 255});
  grid.add({0.56, 0.07, -0.05}, {13, 1, 255});
  grid.add({0.57, 0.08, -0.03}, {20, 1, 254});
  grid.add({0.56, 0.07, 0.01}, {1, 2, 3});  // the voxel next door
  const std::vector<Voxel> voxels = grid.voxels();
  ASSERT_EQ(voxels.size(), 2U);
  EXPECT_LT((voxels[0].mean - Eigen::Vector3f(0.55F, 0.06F, -0.03F)).norm(), 1e-7);
  EXPECT_EQ(voxels[0].color, (Rgb{14, 1, 255}));  // 14.33, 0.67, 254.67 rounded
  EXPECT_EQ(voxels[0].count, 3U);
  EXPECT_EQ(voxels[1].color, (Rgb{1, 2, 3}));
}

TEST(VoxelGrid, WeighsSamples) {
  VoxelGrid grid(1);
  grid.add({0.2, 0.5, 0.5}, {0, 0, 0}, 3);
  grid.add({0.6, 0.5, 0.5}, {100, 40, 8}, 1);
  const Voxel voxel = grid.voxels().at(0);
  EXPECT_NEAR(voxel.mean.x(), 0.3, 1e-7);
  EXPECT_EQ(voxel.color, (Rgb{25, 10, 2}));
  EXPECT_EQ(voxel.count, 4U);
}

TEST(VoxelGrid, StaysExactFarFromTheOrigin) {
  VoxelGrid grid(0.01);
  const Eigen::Vector3d far(-1000.004, 2000.003, 500.002);
  for (int i = 0; i < 1000; ++i) grid.add(far, {});
  ASSERT_EQ(grid.size(), 1U);
  EXPECT_LT((grid.voxels()[0].mean.cast<double>() - far).norm(), 2e-4);  // one float at 2 km
}

TEST(VoxelGrid, OrdersByLatticeWhateverTheOrderOfSamples) {
  VoxelGrid forwards(1), backwards(1);
  const int n = 12;  // more voxels than the table begins with, on both sides of the origin
  for (int i = 0; i < n * n * n; ++i) {
    const Eigen::Vector3d p(i / n / n - 5.5, i / n % n - 5.5, i % n - 5.5);
    forwards.add(p, {});
  }
  for (int i = n * n * n - 1; i >= 0; --i) {
    const Eigen::Vector3d p(i / n / n - 5.5, i / n % n - 5.5, i % n - 5.5);
    backwards.add(p, {});
  }
  const auto sorted = forwards.sorted_voxels(), other = backwards.sorted_voxels();
  ASSERT_EQ(sorted.size(), static_cast<std::size_t>(n * n * n));
  ASSERT_EQ(other.size(), sorted.size());
  for (int i = 0; i < n * n * n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(sorted[at].mean, Eigen::Vector3f(static_cast<float>(i / n / n) - 5.5F,
                                               static_cast<float>(i / n % n) - 5.5F,
                                               static_cast<float>(i % n) - 5.5F));
    EXPECT_EQ(other[at].mean, sorted[at].mean);
  }
}

TEST(VoxelGrid, CountsSources) {
  VoxelGrid grid(1);
  for (const std::uint32_t source : {0U, 0U, 1U, 4U, 4U}) grid.add({0.5, 0.5, 0.5}, {}, 1, source);
  EXPECT_EQ(grid.voxels().at(0).sources, 3U);
}

TEST(VoxelGrid, RefusesPointsThatAreNone) {
  VoxelGrid grid(0.01);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity, 1e5, -1e300}) {
    EXPECT_FALSE(grid.add({0, bad, 0}, {})) << bad;
  }
  EXPECT_TRUE(grid.add({1e4, -1e4, 0}, {}));
  EXPECT_EQ(grid.size(), 1U);
}

TEST(VoxelGrid, RefusesAVoxelWithoutSize) {
  for (const double edge : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(VoxelGrid{edge}, Error);
  }
}

}  // namespace
}  // namespace stillmap
