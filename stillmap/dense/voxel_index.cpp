// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/voxel_index.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace stillmap {
namespace {

constexpr int kBits = kVoxelBits;

// The lowest two bits of each coordinate are the place in the block.
constexpr std::uint64_t kWithin = 3 | std::uint64_t{3} << kBits | std::uint64_t{3} << 2 * kBits;

// Returns a hash by the finalizer of MurmurHash3 (Appleby, public domain).
std::size_t hash(Voxel corner, std::size_t slots) {
  corner = (corner ^ corner >> 33) * 0xFF51AFD7ED558CCDU;
  corner = (corner ^ corner >> 33) * 0xC4CEB9FE1A85EC53U;
  return static_cast<std::size_t>((corner ^ corner >> 33) & (slots - 1));
}

unsigned place_of(Voxel voxel) {
  return static_cast<unsigned>((voxel & 3) | (voxel >> (kBits - 2) & 12) |
                               (voxel >> (2 * kBits - 4) & 48));
}

std::uint64_t bit(unsigned place) { return std::uint64_t{1} << place; }

// Returns the end of the blocks from `begin` on with equal coordinates above the lowest `bits`
// bits.
template <typename Iterator>
Iterator end_of_group(Iterator begin, Iterator end, int bits) {
  return std::find_if(begin, end, [&](const auto* block) {
    return block->corner >> bits != (*begin)->corner >> bits;
  });
}

}  // namespace

// Returns the slot of a block, or the free slot for it.
std::size_t VoxelIndex::slot_of(Voxel corner) const {
  std::size_t slot = hash(corner, slots_.size());
  while (slots_[slot].block != 0 && slots_[slot].corner != corner) {
    slot = (slot + 1) & (slots_.size() - 1);
  }
  return slot;
}

std::uint32_t VoxelIndex::block_at(Voxel corner) {
  if (2 * blocks_.size() >= slots_.size()) grow();
  Slot& slot = slots_[slot_of(corner)];
  if (slot.block != 0) return slot.block - 1;
  blocks_.emplace_back().corner = corner;
  const auto count = static_cast<std::uint32_t>(blocks_.size());
  slot = {corner, count};
  return count - 1;
}

std::uint32_t VoxelIndex::add(Voxel voxel) {
  const std::uint32_t number = block_at(voxel & ~kWithin);
  Block& block = blocks_[number];
  const unsigned place = place_of(voxel);
  if ((block.occupied & bit(place)) == 0) {
    block.occupied |= bit(place);
    block.numbers[place] = static_cast<std::uint32_t>(homes_.size());
    homes_.push_back(number * kPlaces + place);
  }
  return block.numbers[place];
}

std::uint32_t VoxelIndex::find(Voxel voxel) const {
  if (slots_.empty()) return kNone;
  const Slot& slot = slots_[slot_of(voxel & ~kWithin)];
  if (slot.block == 0) return kNone;
  const Block& block = blocks_[slot.block - 1];
  const unsigned place = place_of(voxel);
  return (block.occupied & bit(place)) != 0 ? block.numbers[place] : kNone;
}

Voxel VoxelIndex::voxel_in(const Block& block, unsigned place) {
  const std::uint64_t x = place >> 4, y = place >> 2 & 3, z = place & 3;
  return block.corner | x << 2 * kBits | y << kBits | z;
}

Voxel VoxelIndex::voxel(std::uint32_t number) const {
  return voxel_in(blocks_[homes_[number] / kPlaces], homes_[number] % kPlaces);
}

void VoxelIndex::grow() {
  constexpr std::size_t kFewest = 1024;
  slots_.assign(std::max(kFewest, 2 * slots_.size()), {});
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    slots_[slot_of(blocks_[i].corner)] = {blocks_[i].corner, static_cast<std::uint32_t>(i + 1)};
  }
}

// Sorts by slabs of blocks with one x and rows of blocks with one x and y: voxels of one x are in
// one slab, and those of one x and y in one row.
std::vector<std::uint32_t> VoxelIndex::sorted() const {
  std::vector<const Block*> order;
  order.reserve(blocks_.size());
  for (const Block& block : blocks_) order.push_back(&block);
  std::sort(order.begin(), order.end(),
            [](const Block* a, const Block* b) { return a->corner < b->corner; });
  std::vector<std::uint32_t> numbers;
  numbers.reserve(size());
  const auto add_line = [&](auto begin, auto end, unsigned xy) {
    for (auto block = begin; block != end; ++block) {
      for (unsigned place = xy; place < xy + kSide; ++place) {
        if (((*block)->occupied & bit(place)) != 0) numbers.push_back((*block)->numbers[place]);
      }
    }
  };
  for (auto slab = order.begin(); slab != order.end();) {
    const auto slab_end = end_of_group(slab, order.end(), 2 * kBits);
    for (unsigned x = 0; x < kSide; ++x) {
      for (auto row = slab; row != slab_end;) {
        const auto row_end = end_of_group(row, slab_end, kBits);
        for (unsigned y = 0; y < kSide; ++y) add_line(row, row_end, kSide * (kSide * x + y));
        row = row_end;
      }
    }
    slab = slab_end;
  }
  return numbers;
}

void require_voxel_size(double edge, const char* option) {
  if (edge > 0 && std::isfinite(edge)) return;
  throw Error("the side of a voxel must be positive, but is " + std::to_string(edge), option,
              "give it in meters, for example 0.01");
}

}  // namespace stillmap
