// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/trajectory_error.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// One run of one system on one sequence.
struct RecordedRun {
  std::string name;      ///< system or preset
  std::string sequence;  ///< may be empty where all runs are of the same
  Trajectory estimate;
  Trajectory truth;
  std::optional<std::size_t> total_frames;  ///< length of the sequence, where known
};

/// A run's figures; where it could not be evaluated, the reason instead.
struct ComparedRun {
  std::string name, sequence;
  std::optional<Evaluation> evaluation;
  std::string problem;
  std::size_t baseline = 0;  ///< index of the run it is compared with; its own for a baseline
  Trajectory truth;
};

struct Comparison {
  std::vector<ComparedRun> runs;
};

/// Improvement rate in per cent, (alpha - beta) / alpha * 100, with alpha the baseline's figure and
/// beta the other's: equation 4 of SLAM3-YOLOv8. NaN where the baseline is zero.
double improvement_rate(double alpha, double beta);

/// Evaluates every run; the first run of each sequence is the baseline of the others on it. A run
/// that cannot be evaluated (no overlap, too few poses) keeps its place with the reason.
Comparison compare_runs(std::span<const RecordedRun> runs);

/// Three text tables (ATE, RPE translation, RPE rotation over 1 s): RMSE, mean, median and SD, each
/// with its improvement rate over the baseline, pairs and coverage.
std::string comparison_text(const Comparison& comparison);

/// Everything in the text tables, per run: evaluation, improvement_percent by figure, or problem.
void to_json(nlohmann::json& json, const Comparison& comparison);

}  // namespace stillmap
