// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/voxel_key.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Numbers voxels 0, 1, 2 ... in the order in which they are first met. Memory follows the surface
/// seen: blocks of 4^3 voxels, a hash table over them, and in each a list of numbers; about 20
/// bytes for a voxel of a surface. Nothing moves when more is added, so growing needs no room for
/// a copy. What is known of voxel number i lies in a list of the owner's. Depends on the voxels and
/// their order alone.
class VoxelIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr int kSide = 4;                                  ///< of a block [voxels]
  static constexpr std::uint32_t kPlaces = kSide * kSide * kSide;  ///< in a block

  /// Voxels side by side. Block number b is the b-th that was met.
  struct Block {
    Voxel corner = 0;            ///< the lowest of them
    std::uint64_t occupied = 0;  ///< bit i: place i has a number; the order of places is x, y, z
    std::array<std::uint32_t, kPlaces> numbers = {};  ///< by place, where occupied
  };

  /// The number of a voxel, a new one if it has none yet.
  std::uint32_t add(Voxel voxel);
  /// The number of a voxel, kNone if it has none.
  std::uint32_t find(Voxel voxel) const;

  std::size_t size() const { return homes_.size(); }
  Voxel voxel(std::uint32_t number) const;
  /// All numbers in the order of the lattice: x, then y, then z.
  std::vector<std::uint32_t> sorted() const;

  std::size_t block_count() const { return blocks_.size(); }
  const Block& block(std::uint32_t number) const { return blocks_[number]; }
  /// The block that holds voxel `number`.
  std::uint32_t block_of(std::uint32_t number) const { return homes_[number] / kPlaces; }
  /// The voxel at a place of a block.
  static Voxel voxel_in(const Block& block, unsigned place);

  std::size_t bytes() const;

 private:
  /// Both in one place, so that a look-up is one miss of the cache.
  struct Slot {
    Voxel corner = 0;
    std::uint32_t block = 0;  // + 1; 0: free
  };
  std::size_t slot_of(Voxel corner) const;
  std::uint32_t block_at(Voxel corner);
  void grow();

  std::deque<Block> blocks_;
  std::deque<std::uint32_t> homes_;  // of each voxel: block * kPlaces + place
  std::vector<Slot> slots_;          // open addressing
};

/// Throws Error naming `option` unless edge is positive and finite.
void require_voxel_size(double edge, const char* option);

}  // namespace stillmap
