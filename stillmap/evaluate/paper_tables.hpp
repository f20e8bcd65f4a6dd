// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/figure_table.hpp"
#include "stillmap/evaluate/ghosts.hpp"
#include "stillmap/evaluate/published_figures.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// The preset that takes the place of the papers' baselines, and our own system.
constexpr const char* kPaperBaseline = "orb-rgbd";
constexpr const char* kOwnSystem = "fused";

/// A run of a system on a sequence, from which the papers' tables are computed.
struct PaperRun {
  std::string preset;  ///< The preset, or the name of a variant of one or of another system.
  std::string sequence;
  int first = 0;                         ///< First frame of the run.
  std::optional<Evaluation> evaluation;  ///< Errors, with the RPE from frame to frame.
  double tracking_ms = 0;                ///< Mean tracking time per frame [ms].
  double total_ms = 0;  ///< Time of the run divided by its frames, with networks and mapping [ms].
  std::string problem = {};   ///< Reason why there is no evaluation.
  std::string detector = {};  ///< Network or masks; empty without one.
  double waiting_ms = 0;      ///< Mean time per frame in which tracking waits for the network [ms].
  std::optional<double> highly_dynamic =
      {};                                ///< Share of such frames, with a dynamics gate [0..1].
  bool timed = true;                     ///< Whether the times are known.
  std::optional<GhostFigures> map = {};  ///< Of the dense map, where true masks are known.
};

/// What the tables of a paper compare beside its preset.
struct Comparands {
  std::string reference = kPaperBaseline;  ///< System that the improvement rates are over.
  std::vector<std::string> others = {};    ///< Further columns, such as variants of a preset.
};

/// Returns the mean over all runs of a preset on a sequence; none without such a run, if one of
/// them has no evaluation (the mean would be one over other starts than the baseline's), or for a
/// measure that compares two presets.
/// @param statistic  "rmse", "mean", "median" or "sd"
std::optional<double> mean_over_runs(std::span<const PaperRun> runs, const std::string& preset,
                                     const std::string& sequence, PaperMeasure measure,
                                     const std::string& statistic);

/// Returns the tables of a paper with the figures of the runs and the published ones, and a table
/// with times per frame and the share of tracked frames: one row per sequence and statistic. First
/// the sequences of the paper, measured or not, then all others, then the means that the abstracts
/// give: of errors over the walking sequences (and over those of the kitchen), of times over all
/// sequences of the paper. Figures of several runs are averaged, as in the papers, before the
/// improvement rate is computed; the runs are shown beside their mean.
std::vector<FigureTable> paper_tables(const Paper& paper, std::span<const PaperRun> runs,
                                      const Comparands& comparands = {});

/// Returns tables with a row per system and a column per sequence: the median and the worst ATE of
/// the runs, the mean of the improvement rates, RPE, tracked frames, times and, of presets with a
/// dynamics gate, the share of highly dynamic frames. The name of each is its key in the result.
std::vector<std::pair<std::string, FigureTable>> summary_tables(
    std::span<const PaperRun> runs, const std::vector<std::string>& systems,
    const std::string& reference);

/// Writes the figures of one run (for nlohmann::json).
void to_json(nlohmann::json& json, const PaperRun& run);

}  // namespace stillmap
