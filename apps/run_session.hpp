// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dense_outputs.hpp"
#include "label_recorder.hpp"

namespace stillmap {

/// Saved maps, as the user named them; empty: none.
struct MapFiles {
  std::filesystem::path load, save;
  bool slim = false;        ///< saved without the dense cloud
  double load_seconds = 0;  ///< that reading took
};

/// In a run's folder: the map, and the options that it was made with, for `stillmap dense`.
constexpr const char* kRunMap = "run.map";
constexpr const char* kRunOptions = "options.yaml";

/// What is to be run, and where the results go.
struct Session {
  std::string sequence;  ///< name for headings
  std::unique_ptr<FrameSource> source;
  std::optional<std::size_t> total_frames;  ///< for progress and coverage
  std::unique_ptr<Detector> detector;       ///< null: none
  std::optional<Trajectory> truth;
  SlamOptions options;
  std::filesystem::path out;
  LabelRecording labels;             ///< what to keep of the labels on motion
  std::optional<StartingMap> start;  ///< a map to begin in
  MapFiles maps;
  DenseOutputs dense;    ///< files to be made of the dense map besides its cloud
  bool profile = false;  ///< also tell where the time went, per thread and function
};

/// What came of it.
struct SessionReport {
  SlamResult result;
  std::optional<Evaluation> evaluation;
  std::vector<std::filesystem::path> files;  ///< written
  bool interrupted = false;
};

/// Runs the sequence to its end (or Ctrl-C), writes everything into the folder, and prints the
/// headline figures and the files. What fails after the run (no truth that overlaps, say) is
/// reported, and does not cost the results.
SessionReport run_session(Session session);

}  // namespace stillmap
