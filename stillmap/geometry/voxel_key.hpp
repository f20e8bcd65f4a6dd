// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

namespace stillmap {

/// A cube of space: its three lattice coordinates in one number, 21 bits each, x highest, so that
/// the order of the numbers is the order of the lattice. Never zero or all ones.
using Voxel = std::uint64_t;

/// Lattice coordinates of a voxel, each between -2^20 and 2^20.
using Lattice = Eigen::Vector3i;

/// Bits of a coordinate in a Voxel.
inline constexpr int kVoxelBits = 21;
/// Offset of a coordinate in a Voxel: negative ones sort below positive ones.
inline constexpr std::int64_t kVoxelBias = std::int64_t{1} << (kVoxelBits - 1);

inline Voxel voxel_of(const Lattice& lattice) {
  constexpr std::uint64_t kLowBits = (std::uint64_t{1} << kVoxelBits) - 1;
  Voxel voxel = 0;
  for (int axis = 0; axis < 3; ++axis) {
    voxel =
        voxel << kVoxelBits | (static_cast<std::uint64_t>(lattice[axis] + kVoxelBias) & kLowBits);
  }
  return voxel;
}

inline Lattice lattice_of(Voxel voxel) {
  constexpr std::uint64_t kLowBits = (std::uint64_t{1} << kVoxelBits) - 1;
  const auto axis = [&](int shift) {
    return static_cast<int>(static_cast<std::int64_t>(voxel >> shift & kLowBits) - kVoxelBias);
  };
  return {axis(2 * kVoxelBits), axis(kVoxelBits), axis(0)};
}

/// Returns the voxel of side `edge` [m] that contains a point, or none if the point is not finite
/// or further than 2^20 voxels from the origin.
inline std::optional<Voxel> voxel_at(const Eigen::Vector3d& p, double edge) {
  const Eigen::Array3d scaled = p.array() / edge;
  const bool inside = (scaled.abs() < static_cast<double>(kVoxelBias - 1)).all();  // false for NaN
  if (!inside) return std::nullopt;
  Lattice lattice = scaled.cast<int>();  // toward zero
  for (int axis = 0; axis < 3; ++axis) lattice[axis] -= scaled[axis] < lattice[axis];
  return voxel_of(lattice);
}

/// Returns the lattice coordinates of the voxel of side `edge` [m] that contains a finite point,
/// clamped to 10^6 voxels from the origin.
inline Lattice clamped_lattice_at(const Eigen::Vector3d& p, double edge) {
  constexpr double kOutermost = 1e6;
  return (p / edge).array().floor().cwiseMax(-kOutermost).cwiseMin(kOutermost).cast<int>();
}

/// Returns the lower corner of a voxel [m].
inline Eigen::Vector3d corner_of(Voxel voxel, double edge) {
  return lattice_of(voxel).cast<double>() * edge;
}

/// Returns the center of a voxel [m].
inline Eigen::Vector3d center_of(Voxel voxel, double edge) {
  return (lattice_of(voxel).cast<double>().array() + 0.5) * edge;
}

}  // namespace stillmap
