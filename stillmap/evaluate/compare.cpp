// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/compare.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// One compared error: its name, and its place in the evaluation.
struct Measure {
  const char* title;
  const char* key;
  const Statistics& (*of)(const Evaluation&);
};

constexpr std::array<Measure, 3> kMeasures{{
    {"ATE translation [m]", "ate_translation",
     [](const Evaluation& e) -> const Statistics& { return e.ate.translation; }},
    {"RPE translation over 1 s [m]", "rpe_1s_translation",
     [](const Evaluation& e) -> const Statistics& { return e.rpe.translation; }},
    {"RPE rotation over 1 s [deg]", "rpe_1s_rotation",
     [](const Evaluation& e) -> const Statistics& { return e.rpe.rotation; }},
}};

struct Figure {
  const char* title;
  const char* key;
  double Statistics::*value;
};

constexpr std::array<Figure, 4> kFigures{{{"RMSE", "rmse", &Statistics::rmse},
                                          {"mean", "mean", &Statistics::mean},
                                          {"median", "median", &Statistics::median},
                                          {"SD", "sd", &Statistics::sd}}};

std::size_t first_of_sequence(std::span<const RecordedRun> runs, const std::string& sequence) {
  const auto found = std::find_if(runs.begin(), runs.end(),
                                  [&](const RecordedRun& run) { return run.sequence == sequence; });
  return static_cast<std::size_t>(found - runs.begin());
}

ComparedRun evaluate_run(const RecordedRun& run, std::size_t baseline) {
  ComparedRun result;
  result.name = run.name;
  result.sequence = run.sequence;
  result.baseline = baseline;
  result.truth = run.truth;
  try {
    result.evaluation =
        evaluate_trajectory(run.truth, run.estimate, {.total_frames = run.total_frames});
  } catch (const Error& error) {
    result.problem = error.what();
  }
  return result;
}

/// Returns the evaluation of the run's baseline; null if the run is a baseline itself, or its
/// baseline could not be evaluated.
const Evaluation* baseline_of(const Comparison& comparison, std::size_t index) {
  const std::size_t baseline = comparison.runs[index].baseline;
  const auto& evaluation = comparison.runs[baseline].evaluation;
  return baseline != index && evaluation ? &*evaluation : nullptr;
}

std::string full_name(const ComparedRun& run) {
  return run.sequence.empty() ? run.name : run.name + "  " + run.sequence;
}

/// Returns the improvement rate [%]; NaN if one of the two has no errors, or the baseline's is
/// zero.
double improvement(const Statistics& baseline, const Statistics& statistics, const Figure& figure) {
  if (baseline.count == 0 || statistics.count == 0) return NAN;
  return improvement_rate(baseline.*figure.value, statistics.*figure.value);
}

std::string row(const Comparison& comparison, std::size_t index, const Measure& measure) {
  const ComparedRun& run = comparison.runs[index];
  if (!run.evaluation) return run.problem.substr(0, run.problem.find('\n')) + "\n";
  const Evaluation* baseline = baseline_of(comparison, index);
  const Statistics& statistics = measure.of(*run.evaluation);
  std::string text;
  for (const Figure& figure : kFigures) {
    if (statistics.count == 0) {
      text += fmt::format("{:>10}{:>11}", "-", "");
      continue;
    }
    const double value = statistics.*figure.value;
    const double rate = baseline ? improvement(measure.of(*baseline), statistics, figure) : NAN;
    const std::string percent = std::isnan(rate) ? "" : fmt::format("{:+.1f} %", rate);
    text += fmt::format("{:>10.4f}{:>11}", value, percent);
  }
  const Coverage& coverage = run.evaluation->coverage;
  return text + fmt::format("{:>7}{:>13}\n", statistics.count,
                            fmt::format("{}{}/{}", coverage.estimated ? "~" : "", coverage.tracked,
                                        coverage.total));
}

std::string table(const Comparison& comparison, const Measure& measure) {
  std::size_t width = std::string(measure.title).size();
  for (const ComparedRun& run : comparison.runs) width = std::max(width, full_name(run).size());
  std::string text = fmt::format("{:<{}}", measure.title, width + 2);
  for (const Figure& figure : kFigures)
    text += fmt::format("{:>10}{:>11}", figure.title, "improved");
  text += fmt::format("{:>7}{:>13}\n", "pairs", "coverage");
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    text += fmt::format("{:<{}}", full_name(comparison.runs[i]), width + 2);
    text += row(comparison, i, measure);
  }
  return text;
}

nlohmann::json improvements(const Evaluation& baseline, const Evaluation& evaluation) {
  nlohmann::json json;
  for (const Measure& measure : kMeasures) {
    for (const Figure& figure : kFigures) {
      const double rate = improvement(measure.of(baseline), measure.of(evaluation), figure);
      json[measure.key][figure.key] = std::isnan(rate) ? nlohmann::json() : nlohmann::json(rate);
    }
  }
  return json;
}

}  // namespace

double improvement_rate(double alpha, double beta) {
  if (alpha == 0) return std::numeric_limits<double>::quiet_NaN();
  return (alpha - beta) / alpha * 100;
}

Comparison compare_runs(std::span<const RecordedRun> runs) {
  Comparison comparison;
  for (const RecordedRun& run : runs) {
    comparison.runs.push_back(evaluate_run(run, first_of_sequence(runs, run.sequence)));
  }
  return comparison;
}

std::string comparison_text(const Comparison& comparison) {
  std::string text;
  for (const Measure& measure : kMeasures) {
    if (!text.empty()) text += "\n";
    text += table(comparison, measure);
  }
  return text;
}

void to_json(nlohmann::json& json, const Comparison& comparison) {
  json = {{"runs", nlohmann::json::array()}};
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const ComparedRun& run = comparison.runs[i];
    nlohmann::json entry{{"name", run.name}, {"sequence", run.sequence}};
    entry["baseline"] = comparison.runs[run.baseline].name;
    if (!run.evaluation) {
      entry["problem"] = run.problem;
    } else {
      entry.update(nlohmann::json(*run.evaluation));
      if (const Evaluation* baseline = baseline_of(comparison, i)) {
        entry["improvement_percent"] = improvements(*baseline, *run.evaluation);
      }
    }
    json["runs"].push_back(std::move(entry));
  }
}

}  // namespace stillmap
