// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// A saved map and its name, for messages.
struct NamedMap {
  std::string name;
  SavedMap saved;
};

/// Reads maps. Throws Error as read_saved_map().
/// @param memory for the views of all maps
std::vector<NamedMap> read_named_maps(const std::vector<std::filesystem::path>& files,
                                      const MemoryLimit& memory);

/// Throws Error if a file to write is one of the maps that are read.
/// @param maps  map files or folders of runs
void require_no_input(const std::filesystem::path& out,
                      const std::vector<std::filesystem::path>& maps);

/// Two merged maps, and whether places of one were recognized in the other.
struct MapPair {
  std::size_t a = 0, b = 0;  ///< Their positions in MergedMap::names, a < b.
  std::size_t places = 0;    ///< Number of keyframes whose place is known in the other map.
  int inliers = 0;           ///< Largest number of landmarks that agree with one of these.
  bool connected = false;    ///< They lie in one world, through these places or other maps.
  /// If there are no such places: "connected by other maps", or the test that the most similar
  /// keyframes failed.
  std::string reason;
  int passed = -1;  ///< Number of tests that these passed; -1: no keyframes look alike.
};

/// One map made of several.
struct MergedMap {
  SavedMap saved;
  /// Of the maps, in the order of their sessions in `saved`: first the one whose world component 0
  /// has.
  std::vector<std::string> names;
  std::vector<std::uint32_t> first_sessions;  ///< Of each map: its first session in `saved`.
  std::vector<MapPair> pairs;                 ///< All pairs.
  std::size_t repeated = 0;   ///< Number of keyframes that several of the maps contained.
  std::size_t redundant = 0;  ///< Number of keyframes erased since others show the same.
};

/// Merges maps: the place of each keyframe is searched in all other maps and verified as for loops
/// (see verify_loop()); two components are connected if the places of at least two
/// keyframes show the same motion between them. Then landmarks are welded, keyframes that repeat
/// others or are redundant are erased, and each component is optimized as a whole. Maps in which no
/// common place is recognized remain as unconnected components. More than ten maps are merged in
/// groups by their age, and the results in turn.
///
/// The world frame is that of the map in the frame of a site, of several or none the one with the
/// oldest keyframe; maps of other cameras are converted
/// to its camera: see with_camera(). The result does not depend on the order of the maps. Maps may
/// be merged ones. Throws Error for fewer than two maps, maps of different pyramids, and a map that
/// is given twice.
/// @param writer  name and version of the program
MergedMap merge_maps(std::vector<NamedMap> maps, const SlamParameters& options,
                     const std::string& writer);

/// Returns the pairs of at most ten maps, or which of more lie in one world, and counts, as lines
/// of text.
std::string merge_text(const MergedMap& merged);
/// Returns all pairs and the counts as JSON.
nlohmann::json merge_json(const MergedMap& merged);

}  // namespace stillmap
