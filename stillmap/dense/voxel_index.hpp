// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/voxel_key.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Numbers voxels 0, 1, 2 ... in the order in which they are added; the owner keeps the data of
/// voxel i in a list of its own. Memory grows with the surface: blocks of 4^3 voxels with their
/// numbers and a hash table of the blocks, about 20 bytes for a voxel of a surface. Blocks do not
/// move in memory, so growth needs no copy. Depends on the voxels and their order alone.
class VoxelIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr int kSide = 4;                                  ///< Side of a block [voxels].
  static constexpr std::uint32_t kPlaces = kSide * kSide * kSide;  ///< Number of voxels in a block.

  /// A cube of voxels. Block number b is the b-th that was added.
  struct Block {
    Voxel corner = 0;            ///< Lowest voxel.
    std::uint64_t occupied = 0;  ///< Bit i: place i has a number. Places are ordered by x, y, z.
    std::array<std::uint32_t, kPlaces> numbers = {};  ///< By place, if occupied.
  };

  /// Returns the number of a voxel, which is new if it has none yet.
  std::uint32_t add(Voxel voxel);
  /// Returns the number of a voxel, or kNone if it has none.
  std::uint32_t find(Voxel voxel) const;

  std::size_t size() const { return homes_.size(); }
  Voxel voxel(std::uint32_t number) const;
  /// Returns all numbers in the order of the lattice: x, then y, then z.
  std::vector<std::uint32_t> sorted() const;

  std::size_t block_count() const { return blocks_.size(); }
  const Block& block(std::uint32_t number) const { return blocks_[number]; }
  /// Returns the block of voxel `number`.
  std::uint32_t block_of(std::uint32_t number) const { return homes_[number] / kPlaces; }
  /// Returns the voxel at a place of a block.
  static Voxel voxel_in(const Block& block, unsigned place);

 private:
  /// Corner and number side by side, so that a look-up is one cache miss.
  struct Slot {
    Voxel corner = 0;
    std::uint32_t block = 0;  // block number + 1; 0 if free
  };
  std::size_t slot_of(Voxel corner) const;
  std::uint32_t block_at(Voxel corner);
  void grow();

  std::deque<Block> blocks_;
  std::deque<std::uint32_t> homes_;  // block * kPlaces + place of each voxel
  std::vector<Slot> slots_;          // with open addressing
};

/// Throws Error naming `option` unless edge is positive and finite.
void require_voxel_size(double edge, const char* option);

}  // namespace stillmap
