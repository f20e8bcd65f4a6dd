// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/voxel_grid.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

namespace stillmap {
namespace {

// A voxel's three lattice coordinates in one number, 21 bits each, x highest: numeric order is the
// order of the lattice. The bias makes negative coordinates sort below positive ones.
constexpr int kBits = 21;
constexpr std::int64_t kBias = std::int64_t{1} << (kBits - 1);
constexpr std::uint64_t kLowBits = (std::uint64_t{1} << kBits) - 1;

std::uint64_t pack(const Eigen::Vector3d& lattice) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key =
        key << kBits | static_cast<std::uint64_t>(static_cast<std::int64_t>(lattice[axis]) + kBias);
  }
  return key;
}

Eigen::Vector3d unpack(std::uint64_t key) {
  const auto axis = [&](int shift) {
    return static_cast<double>(static_cast<std::int64_t>(key >> shift & kLowBits) - kBias);
  };
  return {axis(2 * kBits), axis(kBits), axis(0)};
}

// Fibonacci hashing (Knuth, The Art of Computer Programming 3, 6.4): the multiplier is 2^64 /
// golden ratio.
std::size_t hash(std::uint64_t key, std::size_t slots) {
  const std::uint64_t mixed = (key ^ key >> 32) * 0x9E3779B97F4A7C15U;
  return static_cast<std::size_t>(mixed >> (64 - std::bit_width(slots - 1)));
}

std::uint8_t rounded_mean(std::uint32_t sum, std::uint32_t count) {
  return static_cast<std::uint8_t>((sum + count / 2) / count);
}

}  // namespace

VoxelGrid::VoxelGrid(double edge, std::size_t expected)
    : edge_(edge), slots_(std::bit_ceil(std::max<std::size_t>(2 * expected, 1024)), 0) {
  if (!(edge > 0) || !std::isfinite(edge)) {
    throw Error("the side of a voxel must be positive, but is " + std::to_string(edge),
                "dense voxel size", "give it in metres, for example 0.01");
  }
  cells_.reserve(expected);
}

bool VoxelGrid::add(const Eigen::Vector3d& p, const Rgb& color, std::uint32_t weight,
                    std::uint32_t source) {
  const Eigen::Vector3d lattice = (p / edge_).array().floor();
  const bool inside = (lattice.array().abs() < static_cast<double>(kBias)).all();  // false for NaN
  if (!inside || weight == 0) return false;

  Cell& cell = cell_at(pack(lattice));
  cell.offset_sum += static_cast<float>(weight) * (p - lattice * edge_).cast<float>();
  for (std::size_t i = 0; i < 3; ++i) cell.color_sum[i] += weight * color[i];
  if (cell.count == 0 || cell.last_source != source) ++cell.sources;
  cell.last_source = source;
  cell.count += weight;
  return true;
}

VoxelGrid::Cell& VoxelGrid::cell_at(std::uint64_t key) {
  std::size_t slot = hash(key, slots_.size());
  for (; slots_[slot] != 0; slot = (slot + 1) & (slots_.size() - 1)) {
    Cell& cell = cells_[slots_[slot] - 1];
    if (cell.key == key) return cell;
  }
  cells_.push_back({.key = key});
  slots_[slot] = static_cast<std::uint32_t>(cells_.size());
  if (2 * cells_.size() > slots_.size()) grow();
  return cells_.back();
}

void VoxelGrid::grow() {
  slots_.assign(2 * slots_.size(), 0);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    std::size_t slot = hash(cells_[i].key, slots_.size());
    while (slots_[slot] != 0) slot = (slot + 1) & (slots_.size() - 1);
    slots_[slot] = static_cast<std::uint32_t>(i + 1);
  }
}

Voxel VoxelGrid::mean_of(const Cell& cell) const {
  const Eigen::Vector3d corner = unpack(cell.key) * edge_;
  const Eigen::Vector3d offset = cell.offset_sum.cast<double>() / cell.count;
  const auto channel = [&](std::size_t i) { return rounded_mean(cell.color_sum[i], cell.count); };
  return {.mean = (corner + offset).cast<float>(),
          .color = {channel(0), channel(1), channel(2)},
          .count = cell.count,
          .sources = cell.sources};
}

std::vector<Voxel> VoxelGrid::voxels() const {
  std::vector<Voxel> voxels;
  voxels.reserve(cells_.size());
  for (const Cell& cell : cells_) voxels.push_back(mean_of(cell));
  return voxels;
}

void VoxelGrid::for_each_sorted(const std::function<void(const Voxel&)>& visit) const {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(cells_.size());
  for (std::uint32_t i = 0; i < cells_.size(); ++i) order.emplace_back(cells_[i].key, i);
  std::sort(order.begin(), order.end());
  for (const auto& [key, index] : order) visit(mean_of(cells_[index]));
}

}  // namespace stillmap
