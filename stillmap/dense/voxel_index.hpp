// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// A cube of space: its three lattice coordinates in one number, 21 bits each, x highest, so that
/// the order of the numbers is the order of the lattice. Never zero or all ones.
using Voxel = std::uint64_t;

/// Lattice coordinates of a voxel, each between -2^20 and 2^20.
using Lattice = Eigen::Vector3i;

Voxel voxel_of(const Lattice& lattice);
Lattice lattice_of(Voxel voxel);
/// The voxel of side `edge` [m] that holds a point; none if the point is not finite or lies more
/// than 2^20 voxels from the origin.
std::optional<Voxel> voxel_at(const Eigen::Vector3d& p, double edge);
Eigen::Vector3d corner_of(Voxel voxel, double edge);  ///< lower corner [m]
Eigen::Vector3d center_of(Voxel voxel, double edge);  ///< [m]

/// Numbers voxels 0, 1, 2 ... in the order in which they are first met: a hash table over the
/// occupied voxels alone, so memory follows the surface seen. What is known of voxel number i lies
/// in a vector of the owner's. Depends on the voxels and their order alone.
class VoxelIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  /// @param expected voxels to make room for; only a matter of speed
  explicit VoxelIndex(std::size_t expected = 0);

  /// The number of a voxel, a new one if it has none yet.
  std::uint32_t add(Voxel voxel);
  /// The number of a voxel, kNone if it has none.
  std::uint32_t find(Voxel voxel) const;

  std::size_t size() const { return voxels_.size(); }
  Voxel voxel(std::uint32_t number) const { return voxels_[number]; }
  /// All numbers in the order of the lattice: x, then y, then z.
  std::vector<std::uint32_t> sorted() const;
  std::size_t bytes() const;

 private:
  /// Both in one place, so that a look-up is one miss of the cache.
  struct Slot {
    Voxel voxel = 0;
    std::uint32_t number = 0;  // + 1; 0: free
  };
  std::size_t slot_of(Voxel voxel) const;
  void grow();

  std::vector<Voxel> voxels_;
  std::vector<Slot> slots_;  // open addressing
};

/// Throws Error naming `option` unless edge is positive and finite.
void require_voxel_size(double edge, const char* option);

}  // namespace stillmap
