// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/octomap.hpp"

#include "stillmap/base/error.hpp"

#include <octomap/OcTree.h>
#include <random>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns the node at the center of a voxel, or null for unknown space.
const octomap::OcTreeNode* node_at(const octomap::OcTree& tree, Voxel voxel) {
  const Eigen::Vector3d center =
      (lattice_of(voxel).cast<double>() + Eigen::Vector3d::Constant(0.5)) * tree.getResolution();
  return tree.search(center.x(), center.y(), center.z());
}

OccupiedSpace random_space() {
  std::set<Voxel> occupied, free;
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(-20, 20);
  for (int i = 0; i < 500; ++i)
    occupied.insert(voxel_of({place(random), place(random), place(random)}));
  for (int x = 0; x < 16; ++x) {  // A block of equal voxels is pruned to one leaf.
    for (int y = 0; y < 16; ++y) {
      for (int z = 32; z < 48; ++z) free.insert(voxel_of({x, y, z}));
    }
  }
  OccupiedSpace space{.edge = 0.05, .occupied = {}, .free = {}};
  space.occupied.assign(occupied.begin(), occupied.end());
  space.free.assign(free.begin(), free.end());
  return space;
}

TEST(Octomap, ReadsBackAsTheSpaceThatWasWritten) {
  const OccupiedSpace space = random_space();
  std::istringstream file(octomap_bytes(space));
  octomap::OcTree tree(1.0);
  ASSERT_TRUE(tree.readBinary(file));
  EXPECT_DOUBLE_EQ(tree.getResolution(), 0.05);
  for (const Voxel voxel : space.occupied) {
    const octomap::OcTreeNode* node = node_at(tree, voxel);
    ASSERT_NE(node, nullptr);
    EXPECT_TRUE(tree.isNodeOccupied(node));
  }
  for (const Voxel voxel : space.free) {
    const octomap::OcTreeNode* node = node_at(tree, voxel);
    ASSERT_NE(node, nullptr);
    EXPECT_FALSE(tree.isNodeOccupied(node));
  }
  EXPECT_EQ(node_at(tree, voxel_of({40, 40, 40})), nullptr) << "unknown space";
  tree.expand();
  EXPECT_EQ(tree.getNumLeafNodes(), space.occupied.size() + space.free.size());
}

TEST(Octomap, PrunesEqualNeighbors) {
  EXPECT_LT(octomap_bytes(random_space()).size(), 500 * 2 * 10 + 200) << "the block is one leaf";
}

TEST(Octomap, GivesTheSameBytesForTheSameSpace) {
  EXPECT_EQ(octomap_bytes(random_space()), octomap_bytes(random_space()));
}

TEST(Octomap, RefusesASpaceThatIsTooWide) {
  const OccupiedSpace space{.edge = 0.05, .occupied = {voxel_of({32768, 0, 0})}, .free = {}};
  EXPECT_THROW(octomap_bytes(space), Error);
}

}  // namespace
}  // namespace stillmap
