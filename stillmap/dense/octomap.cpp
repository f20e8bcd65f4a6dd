// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/octomap.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kDepth = 16;  // levels of an OctoMap
constexpr int kCenter = 1 << (kDepth - 1);

/// Returns the bits of the three coordinates interleaved: three bits a level, x lowest.
std::uint64_t tree_key(const Lattice& lattice) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto c = static_cast<std::uint64_t>(lattice[axis] + kCenter);
    for (int bit = 0; bit < kDepth; ++bit) key |= (c >> bit & 1) << (3 * bit + axis);
  }
  return key;
}

enum class Leaf : std::uint8_t { kUnknown, kFree, kOccupied, kInner };

struct Keyed {
  std::uint64_t key;
  Leaf leaf;
};

/// Builds the octree over sorted leaves and writes it from the root down.
class OctreeWriter {
 public:
  explicit OctreeWriter(std::vector<Keyed> leaves) : leaves_(std::move(leaves)) {}

  std::string bytes() {
    if (leaves_.empty()) return {};
    build(0, leaves_.size(), kDepth);
    write(nodes_.size() - 1);
    return std::move(bytes_);
  }
  /// Returns the number of nodes, root and leaves included. Valid after bytes().
  std::size_t size() const { return size_; }

 private:
  struct Node {
    std::array<Leaf, 8> kinds{};
    std::array<std::size_t, 8> children{};
  };

  /// Adds the nodes over leaves first .. last - 1 and returns the kind of their common parent,
  /// `level` levels above the finest.
  Leaf build(std::size_t first, std::size_t last, int level) {
    if (level == 0) return leaves_[first].leaf;
    Node node;
    for (std::size_t at = first; at < last;) {
      const auto child = leaves_[at].key >> (3 * (level - 1)) & 7;
      std::size_t end = at;
      while (end < last && (leaves_[end].key >> (3 * (level - 1)) & 7) == child) ++end;
      node.kinds[child] = build(at, end, level - 1);
      node.children[child] = nodes_.empty() ? 0 : nodes_.size() - 1;
      at = end;
    }
    const bool uniform = std::all_of(node.kinds.begin(), node.kinds.end(), [&](Leaf kind) {
      return kind == node.kinds[0] && kind != Leaf::kInner && kind != Leaf::kUnknown;
    });
    if (uniform && level < kDepth) return node.kinds[0];
    nodes_.push_back(node);
    return Leaf::kInner;
  }

  /// Writes two bits for each child, the lower first: 1 0 free, 0 1 occupied, 1 1 inner, 0 0
  /// unknown.
  void write(std::size_t number) {
    const Node node = nodes_[number];
    ++size_;
    std::uint16_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const Leaf kind = node.kinds[i];
      if (kind == Leaf::kFree || kind == Leaf::kInner) bits |= 1U << (2 * i);
      if (kind == Leaf::kOccupied || kind == Leaf::kInner) bits |= 2U << (2 * i);
      size_ += kind == Leaf::kFree || kind == Leaf::kOccupied;
    }
    bytes_.push_back(static_cast<char>(bits & 0xff));
    bytes_.push_back(static_cast<char>(bits >> 8));
    for (std::size_t i = 0; i < 8; ++i) {
      if (node.kinds[i] == Leaf::kInner) write(node.children[i]);
    }
  }

  std::vector<Keyed> leaves_;
  std::vector<Node> nodes_;
  std::string bytes_;
  std::size_t size_ = 0;
};

}  // namespace

std::string octomap_bytes(const OccupiedSpace& space) {
  std::vector<Keyed> leaves;
  const auto add = [&](const std::vector<Voxel>& voxels, Leaf leaf) {
    for (const Voxel voxel : voxels) {
      const Lattice lattice = lattice_of(voxel);
      if ((lattice.array() < -kCenter).any() || (lattice.array() >= kCenter).any()) {
        throw Error("the map is too wide for an OctoMap of this resolution", "octomap",
                    "set dense.occupancy.cell higher");
      }
      leaves.push_back({tree_key(lattice), leaf});
    }
  };
  add(space.occupied, Leaf::kOccupied);
  add(space.free, Leaf::kFree);
  std::sort(leaves.begin(), leaves.end(),
            [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
  OctreeWriter writer(std::move(leaves));
  const std::string data = writer.bytes();
  return fmt::format(
             "# Octomap OcTree binary file\n# made by stillmap; meters, frame map: z up from the "
             "floor\nid OcTree\n"
             "size {}\nres {}\ndata\n",
             writer.size(), space.edge) +
         data;
}

}  // namespace stillmap
