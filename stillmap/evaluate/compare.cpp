// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/compare.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/finding_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>
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

/// Share of frames with a pose above which the errors of two runs are of nearly the same frames.
constexpr double kFullCoverage = 0.9;

struct Figure {
  const char* key;
  double Statistics::*value;
  bool has_rate;  // The tables have a column with its improvement rate.
};

constexpr std::array<Figure, 4> kFigures{{{"rmse", &Statistics::rmse, true},
                                          {"mean", &Statistics::mean, false},
                                          {"median", &Statistics::median, false},
                                          {"sd", &Statistics::sd, true}}};

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
  result.findings = run.findings;
  try {
    result.evaluation =
        evaluate_trajectory(run.truth, run.estimate, {.total_frames = run.total_frames});
  } catch (const Error& error) {
    result.problem = error.what();
    result.findings.push_back(make_finding(
        "not-evaluated",
        "cannot be evaluated: " + result.problem.substr(0, result.problem.find('\n'))));
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

std::string full_name(const ComparedRun& run) { return shown_name(run, "  "); }

/// Returns the improvement rate [%]; NaN if one of the two has no errors, or the baseline's is
/// zero.
double improvement(const Statistics& baseline, const Statistics& statistics, const Figure& figure) {
  if (baseline.count == 0 || statistics.count == 0) return NAN;
  return improvement_rate(baseline.*figure.value, statistics.*figure.value);
}

/// Returns the improvement rate of a run over its baseline [%]; none for a baseline.
std::optional<double> improvement_of(const Comparison& comparison, std::size_t index,
                                     const Measure& measure, const Figure& figure) {
  const ComparedRun& run = comparison.runs[index];
  const Evaluation* baseline = baseline_of(comparison, index);
  if (!run.evaluation || baseline == nullptr) return std::nullopt;
  const double rate = improvement(measure.of(*baseline), measure.of(*run.evaluation), figure);
  return std::isnan(rate) ? std::nullopt : std::optional(rate);
}

/// Returns the improvement rate [%] as a cell. A rate below -100 %, which has no lower bound, is
/// shown as the ratio of the two figures.
FigureCell improvement_cell(const std::optional<double>& rate) {
  if (!rate || *rate >= -100) return {rate, 1};
  const double ratio = 1 - *rate / 100;
  return fmt::format("{:.{}f} x worse", ratio, ratio < 10 ? 1 : 0);
}

std::string coverage_text(const Coverage& coverage) {
  return fmt::format("{}{}/{}", coverage.estimated ? "~" : "", coverage.tracked, coverage.total);
}

std::vector<FigureCell> row(const Comparison& comparison, std::size_t index,
                            const Measure& measure) {
  constexpr int kErrorDigits = 4;
  const ComparedRun& run = comparison.runs[index];
  if (!run.evaluation) return {full_name(run), "failed", "", "", "", "", "", ""};
  const Statistics& errors = measure.of(*run.evaluation);
  std::vector<FigureCell> cells{full_name(run)};
  for (const Figure& figure : kFigures) {
    const std::optional<double> value =
        errors.count == 0 ? std::nullopt : std::optional(errors.*figure.value);
    cells.emplace_back(value, kErrorDigits);
    if (figure.has_rate)
      cells.push_back(improvement_cell(improvement_of(comparison, index, measure, figure)));
  }
  cells.emplace_back(coverage_text(run.evaluation->coverage));
  return cells;
}

/// Returns why the figures of a run are not comparable with those of others; empty if they are.
std::string doubt_of(const ComparedRun& run) {
  if (!run.evaluation) return "";
  const double share = run.evaluation->coverage.share();
  if (share >= kFullCoverage) return "";
  return fmt::format("only {:.0f} % of the frames have a pose; the errors are of these alone",
                     100 * share);
}

/// Returns a text as one cell of comma-separated values (RFC 4180).
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string csv_line(const Comparison& comparison, std::size_t index, const Measure& measure) {
  const ComparedRun& run = comparison.runs[index];
  std::string line =
      fmt::format("{},{},{}", csv_cell(run.name), csv_cell(run.sequence), measure.key);
  const std::string findings = csv_cell(fmt::format("{}", fmt::join(texts_of(run.findings), "; ")));
  if (!run.evaluation) return line + ",,,,,,,,,,,,," + findings + "\n";
  const Statistics& errors = measure.of(*run.evaluation);
  const auto add = [&line](const std::optional<double>& value) {
    line += value ? fmt::format(",{:.6g}", *value) : ",";
  };
  const auto add_error = [&](double value) {
    add(errors.count == 0 ? std::nullopt : std::optional(value));
  };
  for (const Figure& figure : kFigures) add_error(errors.*figure.value);
  add_error(errors.max);
  for (const Figure& figure : kFigures) add(improvement_of(comparison, index, measure, figure));
  const Coverage& coverage = run.evaluation->coverage;
  return line +
         fmt::format(",{},{},{},{}\n", errors.count, coverage.tracked, coverage.total, findings);
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

/// Error below which a trajectory is the truth itself, written with fewer digits [m, degrees].
constexpr double kNoError = 1e-9;

double improvement_rate(double alpha, double beta) {
  if (alpha < kNoError) return std::numeric_limits<double>::quiet_NaN();
  return (alpha - beta) / alpha * 100;
}

std::string shown_name(const ComparedRun& run, const std::string& separator) {
  const std::string name = run.sequence.empty() ? run.name : run.name + separator + run.sequence;
  return run.findings.empty() ? name : name + " (untrusted)";
}

std::vector<Finding> findings_of(const Comparison& comparison) {
  std::vector<Finding> findings;
  for (const ComparedRun& run : comparison.runs) {
    const std::string name = run.sequence.empty() ? run.name : run.name + ", " + run.sequence;
    for (Finding finding : run.findings) {
      finding.message = name + ": " + finding.message;
      findings.push_back(std::move(finding));
    }
  }
  return findings;
}

Comparison compare_runs(std::span<const RecordedRun> runs) {
  Comparison comparison;
  for (const RecordedRun& run : runs) {
    comparison.runs.push_back(evaluate_run(run, first_of_sequence(runs, run.sequence)));
  }
  return comparison;
}

std::vector<FigureTable> comparison_tables(const Comparison& comparison) {
  std::vector<FigureTable> tables;
  for (const Measure& measure : kMeasures) {
    FigureTable& table = tables.emplace_back();
    table.title = measure.title;
    table.columns = {"run", "RMSE", "gain [%]", "mean", "median", "SD", "gain [%]", "frames"};
    for (std::size_t i = 0; i < comparison.runs.size(); ++i)
      table.rows.push_back(row(comparison, i, measure));
  }
  for (const ComparedRun& run : comparison.runs) {
    const std::string doubt = doubt_of(run);
    if (!doubt.empty()) tables.front().notes.push_back(full_name(run) + ": " + doubt);
  }
  return tables;
}

namespace {

/// Returns the tables with the findings as notes of the first one.
std::vector<FigureTable> tables_with_findings(const Comparison& comparison) {
  std::vector<FigureTable> tables = comparison_tables(comparison);
  for (const Finding& finding : findings_of(comparison))
    tables.front().notes.push_back("Do not trust this result: " + finding.text());
  return tables;
}

}  // namespace

std::string comparison_markdown(const Comparison& comparison) {
  std::string text;
  for (const FigureTable& table : tables_with_findings(comparison)) {
    if (!text.empty()) text += '\n';
    text += table_markdown(table);
  }
  return text;
}

std::string comparison_latex(const Comparison& comparison) {
  std::string text;
  for (const FigureTable& table : tables_with_findings(comparison)) text += table_latex(table);
  return text;
}

std::string comparison_csv(const Comparison& comparison) {
  std::string text =
      "run,sequence,error,rmse,mean,median,sd,max,rmse_improved_percent,mean_improved_percent,"
      "median_improved_percent,sd_improved_percent,pairs,tracked_frames,frames,findings\n";
  for (const Measure& measure : kMeasures) {
    for (std::size_t i = 0; i < comparison.runs.size(); ++i)
      text += csv_line(comparison, i, measure);
  }
  return text;
}

void to_json(nlohmann::json& json, const Comparison& comparison) {
  json = {{"runs", nlohmann::json::array()}};
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const ComparedRun& run = comparison.runs[i];
    nlohmann::json entry{{"name", run.name}, {"sequence", run.sequence}};
    entry["findings"] = run.findings;
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
