// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/evaluate/figure_table.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// One run of one system on one sequence.
struct RecordedRun {
  std::string name;      ///< Name of the system or preset.
  std::string sequence;  ///< Name of the sequence; may be empty if all runs use the same one.
  Trajectory estimate;
  Trajectory truth;
  std::optional<std::size_t> total_frames;  ///< Number of frames of the sequence, if known.
  std::vector<Finding> findings = {};       ///< Reasons not to trust its trajectory.
};

/// Figures of a run, or the reason if it could not be evaluated.
struct ComparedRun {
  std::string name, sequence;
  std::optional<Evaluation> evaluation;
  std::string problem;
  std::size_t baseline = 0;  ///< Index of the run it is compared with; its own for a baseline.
  Trajectory truth;
  std::vector<Finding> findings;  ///< Reasons not to trust the run or its evaluation.
};

struct Comparison {
  std::vector<ComparedRun> runs;
};

/// Returns the improvement rate (alpha - beta) / alpha * 100 [%], with alpha the figure of the
/// baseline and beta that of the other run: equation 4 of SLAM3-YOLOv8. NaN if the baseline's
/// is below 1e-9, that of the truth itself.
double improvement_rate(double alpha, double beta);

/// Evaluates every run; the first run of each sequence is the baseline of the others on it. A run
/// that cannot be evaluated (no overlap, too few poses) keeps its place with the reason.
Comparison compare_runs(std::span<const RecordedRun> runs);

/// Returns the name of a run with that of its sequence behind the separator, and a mark if the run
/// should not be trusted.
std::string shown_name(const ComparedRun& run, const std::string& separator);

/// Returns the findings of the compared runs, each behind the name of its run.
std::vector<Finding> findings_of(const Comparison& comparison);

/// Returns three tables (ATE, RPE translation, RPE rotation over 1 s) with RMSE, mean, median and
/// SD, the improvement rates of RMSE and SD over the baseline (gain, in the next column), and the
/// coverage. With short names the tables fit into a terminal of 80 columns. For a value of more
/// than twice that of the baseline, the ratio is shown instead of the rate. Runs that
/// should not be trusted are marked.
std::vector<FigureTable> comparison_tables(const Comparison& comparison);

/// Returns these tables in Markdown, which is also readable as text, and as LaTeX. The findings are
/// notes of the first table.
std::string comparison_markdown(const Comparison& comparison);
std::string comparison_latex(const Comparison& comparison);

/// Returns comma-separated values with one line per run and error: RMSE, mean, median, SD, largest
/// error and number of pairs, the four improvement rates [%], the coverage, and the findings. Cells
/// without a figure are empty.
std::string comparison_csv(const Comparison& comparison);

/// Writes the figures by run: evaluation and improvement_percent by figure, or problem; and
/// findings.
void to_json(nlohmann::json& json, const Comparison& comparison);

}  // namespace stillmap
