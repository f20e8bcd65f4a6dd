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
  std::string preset;  ///< Name of a preset, a variant or another system.
  std::string sequence;
  int first = 0;                         ///< First frame of the run.
  std::optional<Evaluation> evaluation;  ///< Errors, with the RPE from frame to frame.
  double tracking_ms = 0;                ///< Mean tracking time per frame [ms].
  double total_ms = 0;  ///< Time of the run divided by its frames, with networks and mapping [ms].
  std::string problem = {};   ///< Reason why there is no evaluation.
  std::string detector = {};  ///< Network or masks; empty without one.
  double waiting_ms = 0;      ///< Mean time per frame in which tracking waits for the network [ms].
  std::optional<double> highly_dynamic =
      {};             ///< Share of highly dynamic frames [0..1]; none without a dynamics gate.
  bool timed = true;  ///< Whether the times are known.
  std::optional<GhostFigures> map = {};  ///< Ghosts in the dense map, if true masks are known.
};

/// Systems that the tables of a paper compare with its preset.
struct Comparands {
  std::string reference = kPaperBaseline;  ///< System to which improvement rates refer.
  std::vector<std::string> others = {};    ///< Further columns, such as variants.
};

/// Returns the mean over all runs of a preset on a sequence; none without such a run, if one of
/// them has no evaluation (the mean would be one over other starts than the baseline's), or for a
/// measure that compares two presets.
/// @param statistic  "rmse", "mean", "median" or "sd"
std::optional<double> mean_over_runs(std::span<const PaperRun> runs, const std::string& preset,
                                     const std::string& sequence, PaperMeasure measure,
                                     const std::string& statistic);

/// Returns the tables of a paper with the figures of the runs and the published ones, and a table
/// with times per frame and the share of tracked frames: one row per sequence and statistic. The
/// sequences of the paper come first, measured or not, then all others, then the means that the
/// abstracts report: errors over the walking sequences (those of the kitchen apart), times over all
/// sequences of the paper. Figures of several runs are averaged, as in the papers, before the
/// improvement rate is computed; the values of the runs are shown beside their mean.
std::vector<FigureTable> paper_tables(const Paper& paper, std::span<const PaperRun> runs,
                                      const Comparands& comparands = {});

/// Returns tables, each with its key, with a row per system and a column per sequence: median and
/// worst ATE of the runs, improvement rate of the mean ATE, RPE, times, share of tracked frames
/// and, where known, the share of highly dynamic frames and the figures of the dense map.
std::vector<std::pair<std::string, FigureTable>> summary_tables(
    std::span<const PaperRun> runs, const std::vector<std::string>& systems,
    const std::string& reference);

/// Writes the figures of one run (for nlohmann::json).
void to_json(nlohmann::json& json, const PaperRun& run);

}  // namespace stillmap
