// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/octomap.hpp"

#include <random>
#include <set>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

// Reads the tree of a .bt file: what its leaves say of each of the finest voxels.
class TreeReader {
 public:
  explicit TreeReader(const std::string& file) : data_(file.substr(file.find("data\n") + 5)) {
    ++nodes;
    read(Lattice::Constant(-32768), 32768);
  }
  std::set<std::tuple<int, int, int>> occupied, free;
  std::size_t nodes = 0;
  bool whole() const { return at_ == data_.size(); }

 private:
  void read(const Lattice& corner, int half) {
    const auto byte = [&] {
      return static_cast<unsigned>(static_cast<unsigned char>(data_.at(at_++)));
    };
    const unsigned low = byte(), bits = low | byte() << 8;
    for (int i = 0; i < 8; ++i) {
      const Lattice child = corner + half * Lattice(i & 1, i >> 1 & 1, i >> 2 & 1);
      const unsigned kind = bits >> (2 * i) & 3;
      nodes += kind != 0;
      if (kind == 3) read(child, half / 2);
      if (kind == 1) fill(free, child, half);
      if (kind == 2) fill(occupied, child, half);
    }
  }
  static void fill(std::set<std::tuple<int, int, int>>& set, const Lattice& corner, int side) {
    for (int x = 0; x < side; ++x) {
      for (int y = 0; y < side; ++y) {
        for (int z = 0; z < side; ++z) set.emplace(corner.x() + x, corner.y() + y, corner.z() + z);
      }
    }
  }
  std::string data_;
  std::size_t at_ = 0;
};

TEST(Octomap, WritesAnOctoMapThatHoldsTheSpace) {
  OccupiedSpace space{.edge = 0.05, .occupied = {}, .free = {}};
  std::set<Voxel> occupied, free;
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(-20, 20);
  for (int i = 0; i < 500; ++i)
    occupied.insert(voxel_of({place(random), place(random), place(random)}));
  for (int x = 0; x < 16; ++x) {  // a block that will be pruned, astride nothing
    for (int y = 0; y < 16; ++y) {
      for (int z = 32; z < 48; ++z) free.insert(voxel_of({x, y, z}));
    }
  }
  space.occupied.assign(occupied.begin(), occupied.end());
  space.free.assign(free.begin(), free.end());
  const std::string file = octomap_bytes(space);
  EXPECT_EQ(file.substr(0, 30), "# Octomap OcTree binary file\n#");
  const TreeReader tree(file);
  EXPECT_TRUE(tree.whole());
  EXPECT_EQ(tree.occupied.size(), occupied.size());
  EXPECT_EQ(tree.free.size(), free.size());
  for (const Voxel voxel : occupied) {
    const Lattice l = lattice_of(voxel);
    EXPECT_TRUE(tree.occupied.contains({l.x(), l.y(), l.z()}));
  }
  EXPECT_NE(file.find("\nsize " + std::to_string(tree.nodes) + "\n"), std::string::npos);
  EXPECT_LT(file.size(), 500 * 2 * 10 + 200);  // the block is one leaf, not 4096
}

}  // namespace
}  // namespace stillmap
