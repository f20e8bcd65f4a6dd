// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/options.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A saved map that a run started from.
struct LoadedMap {
  std::filesystem::path file;
  bool extended = true;  ///< Whether the run added to the map; false: it only localized the camera.
  double seconds = 0;    ///< Time taken to read the file [s].
};

/// All data of a run from which its findings and its files are made.
struct RunDetails {
  SlamResult result;     ///< Trajectory, map, movers and timing.
  Options options;       ///< All options in force.
  std::string detector;  ///< Description of the object detector; empty: none.
  bool detector_gives_boxes_only = false;
  std::optional<SavedMap> map;        ///< The map to be saved, with the views of the dense map.
  std::optional<LoadedMap> loaded;    ///< The map that the run started from.
  std::vector<SkippedFrame> skipped;  ///< Frames that the source could not read.
  std::size_t frames = 0;             ///< Number of frames passed to the tracker.
  std::vector<double> dropped;        ///< Times of frames dropped because tracking was late [s].
  double seconds = 0;                 ///< Wall time of the run, without writing files [s].
  bool recovered = false;             ///< Whether the run was killed; from its journal.
  /// What the user should know about recording and results, see FindingKind.
  std::vector<Finding> findings;

  /// Returns the number of frames of the sequence: processed, dropped and unreadable ones.
  std::size_t total_frames() const { return frames + dropped.size() + frames_skipped(); }
  /// Returns the number of frames that the source could not read.
  std::size_t frames_skipped() const;
  /// Returns the times of all frames that were dropped late, of a recording or a live camera [s].
  std::vector<double> late_frames() const;
};

/// Returns the number of frames of a run with a property, such as FrameRecord::relocalized.
std::size_t frames_with(const SlamResult& result,
                        const std::function<bool(const FrameRecord&)>& property);

}  // namespace stillmap
