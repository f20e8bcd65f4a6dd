// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/obstacles.hpp"

#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cstdint>

#include <Eigen/Geometry>

namespace stillmap {
namespace {

/// Obstacles that are smaller than this in all directions are left out [m].
constexpr double kMinObstacle = 0.15;
/// Minimum share of occupied voxels in a layer by which a box grows [0..1].
constexpr double kMinFilled = 0.3;
/// Minimum number of occupied voxels of a box that no larger box covers.
constexpr int kMinOwnVoxels = 6;

/// The occupied voxels of a height band, and the free ones.
struct Voxels {
  VoxelIndex occupied, free;
  std::vector<Lattice> by_number;  // of the occupied voxels

  bool is_occupied(const Lattice& v) const {
    return occupied.find(voxel_of(v)) != VoxelIndex::kNone;
  }
  bool is_free(const Lattice& v) const { return free.find(voxel_of(v)) != VoxelIndex::kNone; }
};

/// Box of voxels; both corners belong to it.
struct VoxelBox {
  Lattice low, high;
};

template <typename Use>
void for_each_voxel(const VoxelBox& box, const Use& use) {
  for (int x = box.low.x(); x <= box.high.x(); ++x) {
    for (int y = box.low.y(); y <= box.high.y(); ++y) {
      for (int z = box.low.z(); z <= box.high.z(); ++z) use(Lattice(x, y, z));
    }
  }
}

Voxels voxels_between(const OccupiedSpace& space, const OccupancyOptions& options) {
  Voxels voxels;
  for (const Voxel voxel : space.occupied) {
    const double z = center_of(voxel, space.edge).z();
    if (z < options.lowest || z > options.highest) continue;
    voxels.occupied.add(voxel);
    voxels.by_number.push_back(lattice_of(voxel));
  }
  for (const Voxel voxel : space.free) voxels.free.add(voxel);
  return voxels;
}

/// Returns whether a box may grow by a layer: no voxel is free, and enough are occupied.
bool extends(const Voxels& voxels, const VoxelBox& layer) {
  int filled = 0, all = 0;
  bool any_free = false;
  for_each_voxel(layer, [&](const Lattice& v) {
    ++all;
    filled += voxels.is_occupied(v);
    any_free |= voxels.is_free(v);
  });
  return !any_free && filled >= kMinFilled * all;
}

/// Returns the largest box around an occupied voxel that grew by layers on its six sides in turn.
VoxelBox grown(const Voxels& voxels, const Lattice& seed) {
  VoxelBox box{seed, seed};
  for (bool growing = true; growing;) {
    growing = false;
    for (int axis = 0; axis < 3; ++axis) {
      VoxelBox above = box, below = box;
      above.low[axis] = above.high[axis] = box.high[axis] + 1;
      below.low[axis] = below.high[axis] = box.low[axis] - 1;
      if (extends(voxels, above)) box.high[axis] += 1, growing = true;
      if (extends(voxels, below)) box.low[axis] -= 1, growing = true;
    }
  }
  return box;
}

int volume(const VoxelBox& box) { return ((box.high - box.low).array() + 1).prod(); }

/// Returns the numbers of the occupied voxels in a box.
std::vector<std::uint32_t> occupied_in(const Voxels& voxels, const VoxelBox& box) {
  std::vector<std::uint32_t> numbers;
  for_each_voxel(box, [&](const Lattice& v) {
    const std::uint32_t number = voxels.occupied.find(voxel_of(v));
    if (number != VoxelIndex::kNone) numbers.push_back(number);
  });
  return numbers;
}

/// Returns boxes that together cover all occupied voxels, by decreasing volume.
std::vector<VoxelBox> covering_boxes(const Voxels& voxels) {
  std::vector<bool> covered(voxels.by_number.size(), false);
  std::vector<VoxelBox> boxes;
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (covered[i]) continue;
    boxes.push_back(grown(voxels, voxels.by_number[i]));
    for (const std::uint32_t number : occupied_in(voxels, boxes.back())) covered[number] = true;
  }
  std::stable_sort(boxes.begin(), boxes.end(),
                   [](const auto& a, const auto& b) { return volume(a) > volume(b); });
  return boxes;
}

/// Removes the boxes that cover few voxels that no larger box covers.
void remove_redundant(const Voxels& voxels, std::vector<VoxelBox>& boxes) {
  std::vector<bool> covered(voxels.by_number.size(), false);
  std::erase_if(boxes, [&](const VoxelBox& box) {
    const std::vector<std::uint32_t> inside = occupied_in(voxels, box);
    const auto own = std::count_if(inside.begin(), inside.end(),
                                   [&](std::uint32_t number) { return !covered[number]; });
    if (own < kMinOwnVoxels) return true;
    for (const std::uint32_t number : inside) covered[number] = true;
    return false;
  });
}

StaticObstacle obstacle_of(const VoxelBox& box, double edge, double yaw) {
  const Eigen::Vector3d low = box.low.cast<double>() * edge,
                        high = (box.high.array() + 1).cast<double>() * edge;
  return {.center = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * ((low + high) / 2),
          .size = high - low,
          .yaw = yaw};
}

}  // namespace

bool StaticObstacle::contains(const Eigen::Vector3d& p_map) const {
  const Eigen::Vector3d p = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * (p_map - center);
  return (p.cwiseAbs().array() <= size.array() / 2).all();
}

std::vector<StaticObstacle> obstacles_in(const OccupiedSpace& space, double yaw,
                                         const OccupancyOptions& options) {
  const Voxels voxels = voxels_between(space, options);
  std::vector<VoxelBox> boxes = covering_boxes(voxels);
  remove_redundant(voxels, boxes);
  std::vector<StaticObstacle> found;
  for (const VoxelBox& box : boxes) {
    StaticObstacle obstacle = obstacle_of(box, space.edge, yaw);
    if (obstacle.size.maxCoeff() < kMinObstacle) continue;
    obstacle.id = static_cast<int>(found.size() + 1);
    found.push_back(obstacle);
  }
  return found;
}

}  // namespace stillmap
