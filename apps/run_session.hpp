// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/truth_findings.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/view/view_server.hpp"
#include "stillmap/warn/rules.hpp"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace stillmap {

/// Input and outputs of one run.
struct Session {
  std::string sequence;   ///< Name of the sequence, for headings.
  std::string recording;  ///< Absolute path of the recording, or name of the live camera.
  std::unique_ptr<FrameSource> source;
  std::optional<std::size_t> total_frames;  ///< Length of the sequence, if known.
  std::unique_ptr<Detector> detector;       ///< Null: none.
  std::optional<Trajectory> truth;          ///< True trajectory, T_world_camera.
  TrajectoryNames names = {};               ///< Of the true trajectory and of that of the run.
  Options options;
  SlamParameters parameters;         ///< The parameters that follow from the options.
  std::optional<StartingMap> start;  ///< Map to start from.
  std::optional<LoadedMap> loaded;   ///< Where that map comes from.
  std::filesystem::path out;         ///< Folder of the results.
  ResultFolder::Foreign foreign = ResultFolder::Foreign::kKeep;
  RunOutputs outputs;
  bool live_camera = false;       ///< Whether the source is a camera, which drops frames by itself.
  bool live = false;              ///< Whether the source delivers frames while they are recorded.
  std::vector<Finding> findings;  ///< About recording, network and settings, before the run.
  std::optional<WarningRules> rules;  ///< Rules of --zones; none: no warnings.
  std::FILE* event_lines = nullptr;   ///< Receives the events as lines of JSON; null: none.
  std::unique_ptr<ViewServer> view;   ///< Serves the page that shows the run; null: none.
  bool quiet = false;                 ///< Whether summary and names of files are not printed.
  bool verbose = false;               ///< Whether events and times of stages are printed as well.
  double begun = 0;  ///< Time from program start to this run, if the program makes several [s].
};

/// Throws Error if the run would overwrite a file that Stillmap did not write. For a check before
/// the first computation.
void require_free_outputs(const Session& session);

/// Runs the sequence to its end, or until Ctrl-C; writes the results and prints a summary with the
/// names of the files. Throws Error if a file cannot be written, after writing all others.
RunRecord run_session(Session session);

}  // namespace stillmap
