// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/octomap.hpp"

#include "stillmap/base/error.hpp"

#include <octomap/OcTree.h>
#include <sstream>
#include <vector>

namespace stillmap {
namespace {

/// Key of the voxel at the origin, as an OctoMap has 16 levels.
constexpr int kCenter = 1 << 15;

octomap::OcTreeKey key_of(const Lattice& lattice) {
  if ((lattice.array() < -kCenter).any() || (lattice.array() >= kCenter).any()) {
    throw Error("the map is too wide for an OctoMap of this resolution", "octomap",
                "set outputs.planner_cell higher");
  }
  const auto key = [&](int axis) {
    return static_cast<octomap::key_type>(lattice[axis] + kCenter);
  };
  return {key(0), key(1), key(2)};
}

void set(octomap::OcTree& tree, const std::vector<Voxel>& voxels, float log_odds) {
  constexpr bool kLazy = true;  // Inner nodes are updated once at the end.
  for (const Voxel voxel : voxels) tree.setNodeValue(key_of(lattice_of(voxel)), log_odds, kLazy);
}

/// Returns the octree of a space with free and occupied voxels as certain as OctoMap allows.
octomap::OcTree tree_of(const OccupiedSpace& space) {
  octomap::OcTree tree(space.edge);
  set(tree, space.free, tree.getClampingThresMinLog());
  set(tree, space.occupied, tree.getClampingThresMaxLog());
  tree.updateInnerOccupancy();
  tree.prune();
  return tree;
}

}  // namespace

/// As OcTree::writeBinaryConst(), which also prints its progress to standard error.
std::string octomap_bytes(const OccupiedSpace& space) {
  const octomap::OcTree tree = tree_of(space);
  std::ostringstream bytes;
  bytes << "# Octomap OcTree binary file\n"
           "# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
        << "id " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
        << tree.getResolution() << "\ndata\n";
  tree.writeBinaryData(bytes);
  return bytes.str();
}

}  // namespace stillmap
