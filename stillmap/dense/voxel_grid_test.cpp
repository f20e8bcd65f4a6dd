// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/voxel_grid.hpp"

#include "stillmap/base/error.hpp"

#include <limits>
#include <ranges>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

std::vector<Voxel> sorted_voxels(const VoxelGrid& grid) {
  std::vector<Voxel> voxels;
  grid.for_each_sorted([&](const Voxel& voxel) { voxels.push_back(voxel); });
  return voxels;
}

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

// Centres of a block of 12^3 voxels around the origin, in the order of the lattice: more voxels
// than the table begins with.
std::vector<Eigen::Vector3f> block_centres() {
  std::vector<Eigen::Vector3f> centres;
  for (int x = -6; x < 6; ++x) {
    for (int y = -6; y < 6; ++y) {
      for (int z = -6; z < 6; ++z)
        centres.emplace_back(0.5F + static_cast<float>(x), 0.5F + static_cast<float>(y),
                             0.5F + static_cast<float>(z));
    }
  }
  return centres;
}

TEST(VoxelGrid, OrdersByLatticeWhateverTheOrderOfSamples) {
  const std::vector<Eigen::Vector3f> centres = block_centres();
  VoxelGrid forwards(1), backwards(1);
  for (const Eigen::Vector3f& p : centres) forwards.add(p.cast<double>(), {});
  for (const Eigen::Vector3f& p : std::views::reverse(centres)) backwards.add(p.cast<double>(), {});
  for (const VoxelGrid* grid : {&forwards, &backwards}) {
    const std::vector<Voxel> sorted = sorted_voxels(*grid);
    ASSERT_EQ(sorted.size(), centres.size());
    for (std::size_t i = 0; i < centres.size(); ++i) EXPECT_EQ(sorted[i].mean, centres[i]);
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
