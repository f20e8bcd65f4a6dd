// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/pipeline/map_changes.hpp"
#include "stillmap/pipeline/merge_maps.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/slam.hpp"

#include <utility>

namespace stillmap {

std::vector<MergedPair> merge_saved_maps(const std::vector<std::filesystem::path>& maps,
                                         const std::filesystem::path& out, const Options& options) {
  require_no_input(out, maps);
  if (std::filesystem::exists(out) && !is_saved_map(out))
    throw Error("exists already and is no map", out.string(), "name another file");
  SlamParameters parameters = parameters_of(options);
  parameters.dense.memory.folder = out.parent_path();
  const MergedMap merged =
      merge_maps(read_named_maps(maps, parameters.dense.memory), parameters, "libstillmap");
  write_saved_map(out, merged.saved);
  std::vector<MergedPair> pairs;
  for (const MapPair& pair : merged.pairs)
    pairs.push_back(
        {merged.names[pair.a], merged.names[pair.b], pair.places, pair.connected, pair.reason});
  return pairs;
}

std::vector<ObjectChange> compare_saved_maps(const std::filesystem::path& before,
                                             const std::filesystem::path& after,
                                             const Options& options) {
  const SlamParameters parameters = parameters_of(options);
  std::vector<NamedMap> maps = read_named_maps({before, after}, parameters.dense.memory);
  return object_changes(find_changes(std::move(maps[0]), std::move(maps[1]), parameters).changes);
}

}  // namespace stillmap
