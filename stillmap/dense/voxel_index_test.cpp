// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/voxel_index.hpp"

#include "stillmap/base/error.hpp"

#include <limits>
#include <ranges>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

// Returns 12^3 voxels around the origin in the order of the lattice, more than the initial table
// holds.
std::vector<Lattice> block() {
  std::vector<Lattice> lattices;
  for (int x = -6; x < 6; ++x) {
    for (int y = -6; y < 6; ++y) {
      for (int z = -6; z < 6; ++z) lattices.emplace_back(x, y, z);
    }
  }
  return lattices;
}

TEST(VoxelIndex, NumbersVoxelsInTheOrderOfAddition) {
  VoxelIndex index;
  const std::vector<Lattice> lattices = block();
  for (std::uint32_t i = 0; i < lattices.size(); ++i) {
    EXPECT_EQ(index.find(voxel_of(lattices[i])), VoxelIndex::kNone);
    EXPECT_EQ(index.add(voxel_of(lattices[i])), i);
  }
  for (std::uint32_t i = 0; i < lattices.size(); ++i) {
    EXPECT_EQ(index.add(voxel_of(lattices[i])), i);
    EXPECT_EQ(index.find(voxel_of(lattices[i])), i);
    EXPECT_EQ(lattice_of(index.voxel(i)), lattices[i]);
  }
  EXPECT_EQ(index.size(), lattices.size());
}

TEST(VoxelIndex, SortsByLatticeForAnyOrderOfAddition) {
  VoxelIndex backwards;
  const std::vector<Lattice> lattices = block();
  for (const Lattice& lattice : std::views::reverse(lattices)) backwards.add(voxel_of(lattice));
  const std::vector<std::uint32_t> sorted = backwards.sorted();
  ASSERT_EQ(sorted.size(), lattices.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    EXPECT_EQ(lattice_of(backwards.voxel(sorted[i])), lattices[i]);
  }
}

TEST(Voxel, ContainsThePointsBetweenItsCorners) {
  const Voxel voxel = voxel_at({0.019, -0.001, 1.0}, 0.01).value();
  EXPECT_EQ(lattice_of(voxel), Lattice(1, -1, 100));
  EXPECT_LT((corner_of(voxel, 0.01) - Eigen::Vector3d(0.01, -0.01, 1.0)).norm(), 1e-12);
  EXPECT_LT((center_of(voxel, 0.01) - Eigen::Vector3d(0.015, -0.005, 1.005)).norm(), 1e-12);
}

TEST(Voxel, DoesNotExistForInvalidPoints) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity, 1e5, -1e300}) {
    EXPECT_FALSE(voxel_at({0, bad, 0}, 0.01)) << bad;
  }
  EXPECT_TRUE(voxel_at({1e4, -1e4, 0}, 0.01));
}

TEST(Voxel, MustHaveAPositiveSize) {
  for (const double edge : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(require_voxel_size(edge, "test"), Error);
  }
}

}  // namespace
}  // namespace stillmap
