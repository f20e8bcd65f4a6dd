// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/run_journal.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/slam.hpp"

#include <filesystem>
#include <vector>

namespace stillmap {

/// The results of a run that did not end, as of its last journal record.
struct RecoveredRun {
  JournalHeading heading;
  SavedMap map;
  std::vector<FrameRecord> frames;  ///< Relative to keyframes of the map, by their positions in it.
  std::vector<MapEvent> events;
  std::vector<MoverTrack> movers;  ///< By id, one per object, in the world of the map.
};

/// Returns the content of a journal. Throws Error if the file is no journal, was damaged in its
/// middle, or ends before its first second.
/// @param memory for the views of the dense map
RecoveredRun recovered_run(const std::filesystem::path& file, const MemoryLimit& memory = {});

}  // namespace stillmap
