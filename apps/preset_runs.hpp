// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/evaluate/benchmark_sequences.hpp"
#include "stillmap/evaluate/compare.hpp"
#include "stillmap/evaluate/ghosts.hpp"
#include "stillmap/evaluate/paper_tables.hpp"
#include "stillmap/report/result_folder.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stillmap {

/// The command line of `stillmap reproduce`.
struct ReproduceArguments {
  std::string paper, data, out = "reproduced";
  std::vector<std::string> models;     ///< "FILE" for all presets, or "PRESET=FILE".
  std::vector<std::string> sequences;  ///< Names of the sequences wanted; empty: all known ones.
  std::vector<std::string> variants;   ///< "NAME=PRESET[:OPTION=VALUE]..."
  std::vector<std::string> baselines;  ///< "NAME=DIR", see read_foreign_runs().
  std::string schedule;                ///< lockstep or realtime; empty: lockstep.
  int runs = 3, frames = 0, width = 640;
  bool true_masks = false, maps = false, force = false;

  ResultFolder::Foreign foreign() const {
    return force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep;
  }
};

/// A preset with changed options: one column of the tables.
struct Variant {
  std::string name;
  std::string preset;                 ///< Name or file of a preset.
  std::vector<std::string> settings;  ///< "group.name=value"
};

/// Returns the variants of the arguments. Throws Error for one that is not of the form
/// NAME=PRESET[:OPTION=VALUE]..., and for a repeated name or the name of a preset.
std::vector<Variant> variants_of(const ReproduceArguments& arguments);

/// A run of a preset with its path.
struct FinishedRun {
  PaperRun figures;
  RecordedRun path;
  std::vector<Finding> findings;  ///< Reasons not to trust its trajectory.
  bool kept = false;              ///< An earlier start of the same experiment made it.
};

/// Returns whether a preset has what it needs on a sequence: a network or masks, unless it detects
/// motion without them.
bool can_run(const ReproduceArguments& arguments, const BenchmarkSequence& sequence,
             const std::string& preset);

/// Throws Error for a network that cannot be read or gives boxes to a preset that needs masks, if
/// it would be used, and for one that is named for none of the presets.
void check_models(const ReproduceArguments& arguments, std::span<const BenchmarkSequence> sequences,
                  std::span<const std::string> presets);

/// Returns the names of the systems of some runs, in the order of their first runs.
std::vector<std::string> systems_of(std::span<const FinishedRun> runs);

/// Throws Error for a NAME of --baseline that another column has, and for a DIR that does not exist
/// or has no trajectory of these sequences; prints the sequences that it lacks.
void require_foreign_runs(const ReproduceArguments& arguments,
                          std::span<const std::string> sequences);

/// Returns the runs of other systems: for each NAME=DIR the trajectories DIR/SEQUENCE.txt or
/// DIR/SEQUENCE_RUN.txt (TUM format; SEQUENCE is the name in the tables). Throws Error for a file
/// that cannot be read or evaluated.
std::vector<FinishedRun> read_foreign_runs(const ReproduceArguments& arguments,
                                           std::span<const BenchmarkSequence> sequences);

/// Volumes swept by movers, computed once for each sequence with true masks.
class GhostReferences {
 public:
  /// Returns the volume swept in this sequence; null without masks.
  const GhostReference* of(const BenchmarkSequence& sequence);

 private:
  std::map<std::filesystem::path, std::unique_ptr<const GhostReference>> made_;
};

/// Maps sequences with presets and variants, `runs` times each: run n begins at frame n.
class PresetRunner {
 public:
  /// @param presets  all presets that will be run, from which the remaining time is estimated
  PresetRunner(const ReproduceArguments& arguments, std::span<const BenchmarkSequence> sequences,
               std::span<const std::string> presets);

  /// Maps every sequence with each of these presets that can run on it. Prints a line per run with
  /// the remaining time of all runs. Runs that an earlier start left complete in the output folder,
  /// with the same options and not older than program and network, are not repeated. A problem is
  /// kept in its run; an interrupt ends all early, without the run that it cuts off.
  void run(std::span<const std::string> presets);

  const std::vector<FinishedRun>& finished() const { return finished_; }

 private:
  std::string time_left() const;

  const ReproduceArguments& arguments_;
  std::span<const BenchmarkSequence> sequences_;
  std::size_t total_;     // number of runs of all presets
  std::size_t made_ = 0;  // number of runs that no earlier start had made
  std::vector<FinishedRun> finished_;
  GhostReferences ghost_references_;
  Stopwatch watch_;
};

/// Returns the figures of all runs.
std::vector<PaperRun> figures_of(std::span<const FinishedRun> runs);

/// Returns a sentence per run that has no figures, with its problem.
std::vector<std::string> problems_of(std::span<const FinishedRun> runs);

/// Returns the reasons not to trust runs of these presets, each behind the name of its run.
std::vector<Finding> findings_of(std::span<const FinishedRun> runs,
                                 std::span<const std::string> presets);

/// Returns the paths from the first frame of these presets, for the figure of the trajectories.
Comparison first_paths(std::span<const FinishedRun> runs, std::span<const std::string> presets);

/// Writes the figure of the trajectories as NAME_trajectories.png and .svg; nothing without a path.
void write_paths(const Comparison& paths, const std::string& name, ResultFolder& folder);

/// Returns sentences about the runs of these presets, for the heading of their tables.
std::string protocol_of(const ReproduceArguments& arguments, std::span<const FinishedRun> runs,
                        std::span<const std::string> presets);

}  // namespace stillmap
