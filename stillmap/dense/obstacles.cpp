// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/obstacles.hpp"

#include "stillmap/base/disjoint_sets.hpp"
#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <queue>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

namespace stillmap {
namespace {

/// Obstacles that are smaller than this in all directions are left out [m].
constexpr double kMinObstacle = 0.15;
/// Minimum share of occupied voxels in a layer by which a box grows [0..1].
constexpr double kMinFilled = 0.3;
/// Height from which, and depth up to which, a box is a part of a wall [m].
constexpr double kMinWallHeight = 1, kMaxWallDepth = 0.35;
/// Minimum number of occupied voxels of a box that no box before it covers.
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

/// Returns the different boxes around all occupied voxels, each as large as it can grow.
std::vector<VoxelBox> largest_boxes(const Voxels& voxels) {
  std::vector<VoxelBox> boxes;
  for (const Lattice& seed : voxels.by_number) boxes.push_back(grown(voxels, seed));
  const auto key = [](const VoxelBox& b) {
    return std::tuple(b.low.x(), b.low.y(), b.low.z(), b.high.x(), b.high.y(), b.high.z());
  };
  std::sort(boxes.begin(), boxes.end(),
            [&](const auto& a, const auto& b) { return key(a) < key(b); });
  boxes.erase(std::unique(boxes.begin(), boxes.end(),
                          [&](const auto& a, const auto& b) { return key(a) == key(b); }),
              boxes.end());
  return boxes;
}

/// Returns boxes that together cover the occupied voxels, chosen one after the other: the one that
/// covers most voxels that none before it covers (the greedy solution of the set cover problem;
/// Chvatal, Mathematics of Operations Research 1979).
std::vector<VoxelBox> covering_boxes(const Voxels& voxels) {
  const std::vector<VoxelBox> boxes = largest_boxes(voxels);
  std::vector<bool> covered(voxels.by_number.size(), false);
  const auto own = [&](std::size_t box) {
    const std::vector<std::uint32_t> inside = occupied_in(voxels, boxes[box]);
    return std::count_if(inside.begin(), inside.end(),
                         [&](std::uint32_t number) { return !covered[number]; });
  };
  // What a box covers alone only becomes less, so a count is made again only at the top.
  std::priority_queue<std::pair<std::ptrdiff_t, std::size_t>> queue;
  for (std::size_t i = 0; i < boxes.size(); ++i) queue.emplace(own(i), i);
  std::vector<VoxelBox> chosen;
  while (!queue.empty()) {
    const auto [count, box] = queue.top();
    queue.pop();
    const std::ptrdiff_t now = own(box);
    if (now < kMinOwnVoxels) continue;
    if (now < count && !queue.empty() && now < queue.top().first) {
      queue.emplace(now, box);
      continue;
    }
    for (const std::uint32_t number : occupied_in(voxels, boxes[box])) covered[number] = true;
    chosen.push_back(boxes[box]);
  }
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const auto& a, const auto& b) { return volume(a) > volume(b); });
  return chosen;
}

enum class Form { kWallAlongX, kWallAlongY, kOther };

/// A wall, or the front of a cupboard, is high, and thin in one direction.
Form form_of(const VoxelBox& box, double edge) {
  const Eigen::Vector3d size = (box.high - box.low).cast<double>().array() * edge + edge;
  const bool wall = size.z() >= kMinWallHeight && size.head<2>().minCoeff() <= kMaxWallDepth;
  if (!wall) return Form::kOther;
  return size.x() > size.y() ? Form::kWallAlongX : Form::kWallAlongY;
}

bool touch(const VoxelBox& a, const VoxelBox& b) {
  return (a.low.array() <= b.high.array() + 1).all() && (b.low.array() <= a.high.array() + 1).all();
}

/// Returns the number of the piece of each box: boxes of one form that touch, directly or through
/// others, are one piece. Pieces are numbered from 1 in the order of their first boxes.
std::vector<int> pieces_of(const std::vector<VoxelBox>& boxes, double edge) {
  std::vector<Form> forms;
  for (const VoxelBox& box : boxes) forms.push_back(form_of(box, edge));
  DisjointSets sets(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = i + 1; k < boxes.size(); ++k) {
      if (forms[i] == forms[k] && touch(boxes[i], boxes[k])) sets.unite(i, k);
    }
  }
  std::vector<int> pieces(boxes.size());
  int count = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    pieces[i] = sets.root(i) == i ? ++count : pieces[sets.root(i)];
  return pieces;
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
  std::erase_if(boxes, [&](const VoxelBox& box) {
    return ((box.high - box.low).maxCoeff() + 1) * space.edge < kMinObstacle;
  });
  const std::vector<int> pieces = pieces_of(boxes, space.edge);
  std::vector<StaticObstacle> found;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    found.push_back(obstacle_of(boxes[i], space.edge, yaw));
    found.back().id = static_cast<int>(i + 1);
    found.back().piece = pieces[i];
  }
  return found;
}

}  // namespace stillmap
