// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"
#include "stillmap/slam.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Two maps of a merge, and whether places of one were recognized in the other.
struct MergedPair {
  std::filesystem::path a, b;
  std::size_t places = 0;  ///< Number of keyframes whose place is known in the other map.
  bool connected = false;  ///< They lie in one world, through these places or other maps.
  std::string reason;      ///< Without places: the test that the most similar keyframes failed.
};

/// Merges saved maps, also of different cameras, in one file; see `stillmap map merge`. The world
/// is that of the oldest map, and what nothing connects stays apart. The result does not depend on
/// the order of the maps.
/// @param maps  map files or folders of runs, two or more
/// @returns all pairs of maps
/// Throws Error for a map that cannot be read or is given twice, for maps of different pyramids,
/// and if the file cannot be written.
std::vector<MergedPair> merge_saved_maps(const std::vector<std::filesystem::path>& maps,
                                         const std::filesystem::path& out,
                                         const Options& options = {});

/// Returns the objects that appeared, went or moved between two visits, the largest first, with
/// their extents in both maps, in the world of the older one; see `stillmap map changes`.
/// @param before,after  map files or folders of runs
/// Throws Error for maps that cannot be read or have no dense views, show no common place, or are
/// of the same recordings.
std::vector<ObjectChange> compare_saved_maps(const std::filesystem::path& before,
                                             const std::filesystem::path& after,
                                             const Options& options = {});

}  // namespace stillmap
