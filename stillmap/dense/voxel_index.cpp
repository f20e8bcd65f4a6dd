// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/voxel_index.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

namespace stillmap {
namespace {

constexpr int kBits = 21;
constexpr std::int64_t kBias = std::int64_t{1} << (kBits - 1);  // negatives sort below positives
constexpr std::uint64_t kLowBits = (std::uint64_t{1} << kBits) - 1;

// The eight voxels of a cube two voxels wide lie side by side, since neighbours are asked for one
// after the other; where the cubes lie is as good as random (finaliser of MurmurHash3, Appleby,
// public domain).
constexpr std::uint64_t kOdd = 1 | std::uint64_t{1} << kBits | std::uint64_t{1} << 2 * kBits;

std::size_t hash(Voxel voxel, std::size_t slots) {
  std::uint64_t cube = voxel & ~kOdd;
  cube = (cube ^ cube >> 33) * 0xFF51AFD7ED558CCDU;
  cube = (cube ^ cube >> 33) * 0xC4CEB9FE1A85EC53U;
  const std::uint64_t within =
      (voxel & 1) | (voxel >> (kBits - 1) & 2) | (voxel >> (2 * kBits - 2) & 4);
  return static_cast<std::size_t>(((cube ^ cube >> 33) << 3 | within) & (slots - 1));
}

}  // namespace

Voxel voxel_of(const Lattice& lattice) {
  Voxel voxel = 0;
  for (int axis = 0; axis < 3; ++axis) {
    voxel = voxel << kBits | (static_cast<std::uint64_t>(lattice[axis] + kBias) & kLowBits);
  }
  return voxel;
}

Lattice lattice_of(Voxel voxel) {
  const auto axis = [&](int shift) {
    return static_cast<int>(static_cast<std::int64_t>(voxel >> shift & kLowBits) - kBias);
  };
  return {axis(2 * kBits), axis(kBits), axis(0)};
}

std::optional<Voxel> voxel_at(const Eigen::Vector3d& p, double edge) {
  const Eigen::Array3d scaled = p.array() / edge;
  const bool inside = (scaled.abs() < static_cast<double>(kBias - 1)).all();  // false for NaN
  if (!inside) return std::nullopt;
  Lattice lattice = scaled.cast<int>();  // towards zero
  for (int axis = 0; axis < 3; ++axis) lattice[axis] -= scaled[axis] < lattice[axis];
  return voxel_of(lattice);
}

Eigen::Vector3d corner_of(Voxel voxel, double edge) {
  return lattice_of(voxel).cast<double>() * edge;
}

Eigen::Vector3d center_of(Voxel voxel, double edge) {
  return (lattice_of(voxel).cast<double>().array() + 0.5) * edge;
}

VoxelIndex::VoxelIndex(std::size_t expected)
    : slots_(std::bit_ceil(std::max<std::size_t>(2 * expected, 1024))) {
  voxels_.reserve(expected);
}

// Where a voxel is, or the free slot where it would be.
std::size_t VoxelIndex::slot_of(Voxel voxel) const {
  std::size_t slot = hash(voxel, slots_.size());
  while (slots_[slot].number != 0 && slots_[slot].voxel != voxel) {
    slot = (slot + 1) & (slots_.size() - 1);
  }
  return slot;
}

std::uint32_t VoxelIndex::add(Voxel voxel) {
  Slot& slot = slots_[slot_of(voxel)];
  if (slot.number != 0) return slot.number - 1;
  voxels_.push_back(voxel);
  const auto count = static_cast<std::uint32_t>(voxels_.size());
  slot = {voxel, count};
  if (2 * voxels_.size() > slots_.size()) grow();
  return count - 1;
}

std::uint32_t VoxelIndex::find(Voxel voxel) const {
  return slots_[slot_of(voxel)].number - 1;  // 0 - 1 is kNone
}

void VoxelIndex::grow() {
  slots_.assign(2 * slots_.size(), {});
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    slots_[slot_of(voxels_[i])] = {voxels_[i], static_cast<std::uint32_t>(i + 1)};
  }
}

std::vector<std::uint32_t> VoxelIndex::sorted() const {
  std::vector<std::pair<Voxel, std::uint32_t>> order;
  order.reserve(voxels_.size());
  for (std::uint32_t i = 0; i < voxels_.size(); ++i) order.emplace_back(voxels_[i], i);
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> numbers;
  numbers.reserve(order.size());
  for (const auto& [voxel, number] : order) numbers.push_back(number);
  return numbers;
}

std::size_t VoxelIndex::bytes() const {
  return voxels_.capacity() * sizeof(Voxel) + slots_.capacity() * sizeof(Slot);
}

void require_voxel_size(double edge, const char* option) {
  if (edge > 0 && std::isfinite(edge)) return;
  throw Error("the side of a voxel must be positive, but is " + std::to_string(edge), option,
              "give it in metres, for example 0.01");
}

}  // namespace stillmap
