// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "run_session.hpp"
#include "view_options.hpp"
#include <CLI/CLI.hpp>

namespace stillmap {

/// A recording to be mapped, and how: the command line of `stillmap run`. Empty texts stand for the
/// defaults.
struct RunRequest {
  std::string sequence, camera, ignore, preset, model, masks, schedule, config, truth, truth_frame,
      topics, associations, out;
  std::vector<std::string> settings;  ///< "group.name=value"
  std::optional<int> first, count, stride;
  std::optional<int> memory;     ///< For the views of the dense map [MB].
  double fps = 30;               ///< Rate of images whose names are numbers, not times [Hz].
  std::optional<double> follow;  ///< Time to wait for images of a growing folder [s].
  int rotate = 0;                ///< As of SourceOptions.
  bool half_size = false;
  std::string load_map, save_map;
  bool localize_only = false, force = false;
  bool quiet = false;    ///< Whether nothing but problems is printed.
  bool verbose = false;  ///< Whether events and the times of all stages are printed as well.
  RunOutputs outputs;
  ViewOptions view;
  std::string zones;                ///< File of the rules for warnings; empty: none.
  std::vector<double> hook_offset;  ///< Point "hook" in the camera frame [m]; empty: none.
  /// Gets the events as lines of JSON; null: they are printed as sentences.
  std::FILE* event_lines = nullptr;
};

/// Each function adds a group of the options of `stillmap run` to a command.
void add_recording_options(CLI::App& command, RunRequest& request);
void add_method_options(CLI::App& command, RunRequest& request);
void add_result_options(CLI::App& command, RunRequest& request);
/// Adds --load-map and --localize-only, and returns the latter.
CLI::Option* add_start_options(CLI::App& command, RunRequest& request);

/// Returns the name of a recording: of its file without extension, its folder, or its camera.
std::string sequence_name(const std::filesystem::path& recording);

/// Returns all options in force. Precedence from low to high: defaults, preset, config, named
/// options, settings.
Options options_of(const RunRequest& request);

/// Opens recording, network and map, and checks the outputs. Throws Error for anything that would
/// end the run early.
/// @param options  as returned by options_of()
Session session_of(const RunRequest& request, const Options& options);

}  // namespace stillmap
