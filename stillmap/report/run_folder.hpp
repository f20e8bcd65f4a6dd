// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/trace.hpp"
#include "stillmap/report/dense_files.hpp"
#include "stillmap/report/label_recorder.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_record.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Counts, events, timing, errors and options of a run: see run_summary_json().
constexpr const char* kRunSummary = "summary.json";
/// The options of a run, from which and kRunMap `stillmap dense` makes the dense map again.
constexpr const char* kRunOptions = "options.yaml";
/// The warnings of a run (--zones), one JSON object per line.
constexpr const char* kRunWarnings = "events.jsonl";
/// The rules of these warnings, see rules_yaml().
constexpr const char* kRunRules = "zones.yaml";

/// Part of a run that writes files into its folder.
enum class RunPart {
  kAlways,
  kLive,      ///< Poses and journal while the command runs; not by write_results().
  kMovers,    ///< The moving objects (movers.enabled).
  kDense,     ///< The dense map (dense.enabled).
  kObjects,   ///< The static objects that a network found in the dense map.
  kMesh,      ///< The mesh (--mesh); those of the wanted formats.
  kPlanner,   ///< The files for planners (--planner).
  kChanges,   ///< What changed since the loaded map was made; not by write_results().
  kLabels,    ///< The motion labels (--save-labels).
  kWarnings,  ///< The warnings (--zones); not by write_results().
  kProfile,   ///< The profile of the computing time (--profile).
};

/// Returns the names of all files that a part may write. The list of files in the help texts is
/// made from it, and docs/dense_map.md is tested against it.
std::vector<std::string> file_names(RunPart part);

/// Throws Error if the last run into a folder goes on or did not end, so that the results there may
/// be those of an earlier one.
void require_ended_run(const std::filesystem::path& folder);

/// Which files are written for a run in addition to the standard ones.
struct RunOutputs {
  DenseOutputs dense;
  std::filesystem::path save_map;  ///< File that the map is saved to; empty: none.
  bool slim_map = false;           ///< Whether the saved map is without the views of the dense map.
  LabelRecording labels;
  std::vector<int> figures;  ///< Frames whose figures are drawn, see FigureRecorder; empty: none.
  bool profile = false;      ///< Whether to write the profile of the computing time.
};

/// Returns the names of the files that a run with these options may write, for
/// ResultFolder::require_free().
std::vector<std::string> possible_run_files(const Options& options, const RunOutputs& outputs);

/// Writes the files of a run: trajectory.txt, trajectory_covariance.txt, keyframes.txt, frames.csv,
/// movers.csv, movers.jsonl, movers.png, the files of the dense map, run.map, options.yaml,
/// timing.txt, summary.json and report.html; and saves the map, if wanted. Problems are kept in the
/// folder: see ResultFolder::require_all().
void write_run_files(RunRecord& record, const RunOutputs& outputs, ResultFolder& folder);

/// Removes the journal of a run if all its files were written, or at least those that hold what the
/// journal does.
void remove_journal(const Options& options, ResultFolder& folder);

/// Writes profile.txt, profile.svg and trace.json. All other threads of the trace must be idle.
/// @param process_cpu_ms  CPU time of the process in the time of the trace [ms]
/// @returns a few lines of text: the utilization of the threads and the most expensive functions
std::string write_profile(const Trace& trace, double process_cpu_ms, ResultFolder& folder);

/// Writes the folder of a run. Files that Stillmap wrote there before and that this run does not
/// write are removed. Throws Error if a file cannot be written, or, unless `foreign` allows it, if
/// that would overwrite a foreign file.
/// @returns the files written
std::vector<std::filesystem::path> write_run_folder(
    RunRecord record, const std::filesystem::path& folder, const RunOutputs& outputs = {},
    ResultFolder::Foreign foreign = ResultFolder::Foreign::kKeep);

}  // namespace stillmap
