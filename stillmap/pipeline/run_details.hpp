// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"
#include "stillmap/pipeline/slam_system.hpp"

#include <optional>
#include <string>

namespace stillmap {

/// All data of a run that was made through the class Slam, for write_results().
struct RunDetails {
  SlamResult result;
  Options options;              ///< All options in force.
  std::string detector;         ///< Description of the object detector; empty: none.
  std::optional<SavedMap> map;  ///< The map with the views of the dense map, if that was made.
  double seconds = 0;           ///< Time from construction to the end of finish() [s].
};

}  // namespace stillmap
