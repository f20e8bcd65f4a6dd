// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the state of a mover at a frame: moving, standing (observed, not known to move) or
/// predicted (not observed).
const char* state_of(const MoverSample& sample);

/// Returns the content of movers.csv: one line per mover and frame, ordered by frame, then id.
/// Comment lines (#) describe the columns and their units, and one line names them: timestamp [s],
/// id, class ("unknown" for none), state (moving, standing or predicted), x y z (centroid) [m],
/// vx vy vz [m/s], min_x ... max_z (box along the world's axes) [m], first_seen, last_seen [s]. The
/// world frame is that of the trajectory.
std::string movers_csv(const std::vector<MoverTrack>& tracks);

/// Returns the content of movers.jsonl: one JSON object per frame with movers, {"timestamp",
/// "movers": [{"id", "class", "class_confidence", "state", "centroid", "velocity", "box": [min,
/// max], "surface": [min, max], "first_seen", "last_seen"}]}. "surface" encloses the measured
/// points, "box" also the hidden part of the object behind them.
std::string movers_jsonl(const std::vector<MoverTrack>& tracks);

/// Reads movers.csv. The tracks have the columns of the file only: no surface, no class confidence,
/// no frame index. Throws Error with file and line.
std::vector<MoverTrack> read_mover_tracks(const std::filesystem::path& file);

/// Figures of one track.
struct MoverPath {
  double length = 0;          ///< Length of the centroid's path, sampled every half second [m].
  double mean_speed = 0;      ///< Mean speed over the frames in which it was observed [m/s].
  double max_speed = 0;       ///< 95th percentile of the speed over these frames [m/s].
  std::size_t observed = 0;   ///< Number of frames in which it was observed.
  std::size_t predicted = 0;  ///< Number of frames in which it was predicted.
};
/// Returns the figures of a track.
MoverPath path_of(const MoverTrack& track);

}  // namespace stillmap
