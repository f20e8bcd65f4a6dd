// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/paper_tables.hpp"

#include "stillmap/evaluate/compare.hpp"

#include <algorithm>
#include <array>
#include <functional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Decimals with which the papers print the figures of a measure.
constexpr int kPercentDecimals = 2;
int decimals_of(PaperMeasure measure) {
  switch (measure) {
    case PaperMeasure::kTrackingTime:
    case PaperMeasure::kAteImprovement:
      return 2;
    default:
      return 4;
  }
}

std::string title_of(PaperMeasure measure) {
  switch (measure) {
    case PaperMeasure::kAte:
      return "ATE [m]";
    case PaperMeasure::kRpeFrameTranslation:
      return "RPE from frame to frame, translation [m]";
    case PaperMeasure::kRpeFrameRotation:
      return "RPE from frame to frame, rotation [deg]";
    case PaperMeasure::kRpeSecondTranslation:
      return "RPE over one second, translation [m]";
    case PaperMeasure::kTrackingTime:
      return "tracking time per frame [ms]";
    case PaperMeasure::kAteImprovement:
      return "improvement of the ATE RMSE over the baseline [%]";
  }
  return "";
}

/// Returns the statistics of a measure in an evaluation; null if it was not computed.
const Statistics* statistics_of(const Evaluation& evaluation, PaperMeasure measure) {
  switch (measure) {
    case PaperMeasure::kAte:
      return &evaluation.ate.translation;
    case PaperMeasure::kRpeFrameTranslation:
      return evaluation.rpe_frame ? &evaluation.rpe_frame->translation : nullptr;
    case PaperMeasure::kRpeFrameRotation:
      return evaluation.rpe_frame ? &evaluation.rpe_frame->rotation : nullptr;
    case PaperMeasure::kRpeSecondTranslation:
      return &evaluation.rpe.translation;
    case PaperMeasure::kTrackingTime:
    case PaperMeasure::kAteImprovement:
      break;
  }
  return nullptr;
}

double value_of(const Statistics& statistics, const std::string& name) {
  if (name == "mean") return statistics.mean;
  if (name == "median") return statistics.median;
  return name == "sd" ? statistics.sd : statistics.rmse;
}

/// Returns the name of a statistic in a table.
std::string shown_name(const std::string& statistic) {
  if (statistic == "sd") return "SD";
  return statistic == "rmse" ? "RMSE" : statistic;
}

/// Returns the figure of one run; none if it was not computed.
std::optional<double> figure_of(const PaperRun& run, PaperMeasure measure,
                                const std::string& statistic) {
  if (!run.evaluation) return std::nullopt;
  if (measure == PaperMeasure::kTrackingTime) return run.tracking_ms;
  const Statistics* statistics = statistics_of(*run.evaluation, measure);
  if (statistics == nullptr || statistics->count == 0) return std::nullopt;
  return value_of(*statistics, statistic);
}

std::optional<double> improvement(std::optional<double> baseline, std::optional<double> other) {
  if (!baseline || !other) return std::nullopt;
  return improvement_rate(*baseline, *other);
}

/// Sequences of the tables: those of the paper, then all others that were run.
std::vector<std::string> sequences_of(const Paper& paper, std::span<const PaperRun> runs) {
  std::vector<std::string> sequences = paper.sequences;
  for (const PaperRun& run : runs) {
    if (std::find(sequences.begin(), sequences.end(), run.sequence) == sequences.end())
      sequences.push_back(run.sequence);
  }
  return sequences;
}

/// Makes one table of a paper.
class TableMaker {
 public:
  TableMaker(const Paper& paper, const PublishedTable& published, std::span<const PaperRun> runs)
      : paper_(paper), published_(published), runs_(runs) {}

  FigureTable make() const {
    FigureTable table;
    table.title = fmt::format("{}, {}: {}", paper_.preset, place(), title_of(published_.measure));
    table.columns = columns();
    for (const std::string& sequence : sequences_of(paper_, runs_)) {
      if (!has_figures(sequence)) continue;
      for (const std::string& statistic : published_.statistics)
        table.rows.push_back(row(sequence, statistic));
    }
    if (!published_.remark.empty()) table.notes.push_back(published_.remark);
    return table;
  }

 private:
  bool compares() const { return published_.measure == PaperMeasure::kAteImprovement; }
  /// Improvement rates are for errors: a time depends on the computer and on what else it does.
  bool improves() const { return !compares() && published_.measure != PaperMeasure::kTrackingTime; }
  bool publishes(const std::string& system) const {
    const auto& systems = published_.systems;
    return std::find(systems.begin(), systems.end(), system) != systems.end();
  }
  bool publishes_improvement() const {
    return improves() && publishes(paper_.baseline) && publishes(paper_.system);
  }
  std::string place() const {
    return published_.number.starts_with("section") ? published_.number
                                                    : "table " + published_.number;
  }
  bool has_figures(const std::string& sequence) const {
    return published_.rows.contains(sequence) ||
           std::any_of(runs_.begin(), runs_.end(),
                       [&](const PaperRun& run) { return run.sequence == sequence; });
  }

  std::vector<std::string> columns() const {
    std::vector<std::string> names{"sequence", "statistic"};
    if (!compares()) names.emplace_back(kPaperBaseline);
    for (const std::string& preset : {paper_.preset, std::string(kOwnSystem)}) {
      names.push_back(preset);
      if (improves()) names.push_back(preset + " improved [%]");
    }
    for (const std::string& system : published_.systems) names.push_back("published: " + system);
    if (publishes_improvement()) names.emplace_back("improved, from the published [%]");
    return names;
  }

  std::optional<double> measured(const std::string& preset, const std::string& sequence,
                                 const std::string& statistic) const {
    const PaperMeasure measure = compares() ? PaperMeasure::kAte : published_.measure;
    return mean_over_runs(runs_, preset, sequence, measure, statistic);
  }

  std::vector<FigureCell> row(const std::string& sequence, const std::string& statistic) const {
    const int decimals = decimals_of(published_.measure);
    std::vector<FigureCell> cells{sequence, shown_name(statistic)};
    const auto baseline = measured(kPaperBaseline, sequence, statistic);
    if (!compares()) cells.emplace_back(baseline, decimals);
    for (const std::string& preset : {paper_.preset, std::string(kOwnSystem)}) {
      const auto figure = measured(preset, sequence, statistic);
      if (!compares()) cells.emplace_back(figure, decimals);
      if (compares() || improves())
        cells.emplace_back(improvement(baseline, figure), kPercentDecimals);
    }
    for (const std::string& system : published_.systems)
      cells.emplace_back(published_.value(sequence, system, statistic), decimals);
    if (publishes_improvement()) {
      cells.emplace_back(improvement(published_.value(sequence, paper_.baseline, statistic),
                                     published_.value(sequence, paper_.system, statistic)),
                         kPercentDecimals);
    }
    return cells;
  }

  const Paper& paper_;
  const PublishedTable& published_;
  std::span<const PaperRun> runs_;
};

using FigureOfRun = std::function<std::optional<double>(const PaperRun&)>;

/// Returns the mean of a figure over the runs of a preset on a sequence; none without a run, or if
/// one of them does not have it.
std::optional<double> mean_of(std::span<const PaperRun> runs, const std::string& preset,
                              const std::string& sequence, const FigureOfRun& figure) {
  double sum = 0;
  int count = 0;
  for (const PaperRun& run : runs) {
    if (run.preset != preset || run.sequence != sequence) continue;
    const auto value = run.evaluation ? figure(run) : std::nullopt;
    if (!value) return std::nullopt;
    sum += *value;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

std::optional<double> tracking_ms_of(const PaperRun& run) { return run.tracking_ms; }
std::optional<double> total_ms_of(const PaperRun& run) { return run.total_ms; }
std::optional<double> tracked_share_of(const PaperRun& run) {
  return 100 * run.evaluation->coverage.share();
}

/// A figure that is no error, with its name in the table.
struct Cost {
  const char* name;
  std::optional<double> (*of)(const PaperRun&);
  int decimals;
};
constexpr std::array kCosts{Cost{"tracking [ms]", tracking_ms_of, 1},
                            Cost{"whole system [ms]", total_ms_of, 1},
                            Cost{"frames tracked [%]", tracked_share_of, 1}};

FigureTable cost_table(const Paper& paper, std::span<const PaperRun> runs) {
  const std::array<std::string, 3> presets{kPaperBaseline, paper.preset, kOwnSystem};
  FigureTable table;
  table.title = paper.preset + ": time per frame, and frames tracked";
  table.columns = {"sequence"};
  for (const Cost& cost : kCosts) {
    for (const std::string& preset : presets)
      table.columns.push_back(fmt::format("{}, {}", preset, cost.name));
  }
  for (const std::string& sequence : sequences_of(paper, runs)) {
    std::vector<FigureCell> row{sequence};
    for (const Cost& cost : kCosts) {
      for (const std::string& preset : presets)
        row.emplace_back(mean_of(runs, preset, sequence, cost.of), cost.decimals);
    }
    if (std::any_of(row.begin(), row.end(), [](const auto& cell) { return cell.value; }))
      table.rows.push_back(std::move(row));
  }
  table.notes.emplace_back(
      "Tracking: the thread of the camera, without waiting for the network. Whole system: the time "
      "of a run divided by its frames, with network, mapping and the final steps.");
  return table;
}

}  // namespace

std::optional<double> mean_over_runs(std::span<const PaperRun> runs, const std::string& preset,
                                     const std::string& sequence, PaperMeasure measure,
                                     const std::string& statistic) {
  return mean_of(runs, preset, sequence,
                 [&](const PaperRun& run) { return figure_of(run, measure, statistic); });
}

std::vector<FigureTable> paper_tables(const Paper& paper, std::span<const PaperRun> runs) {
  std::vector<FigureTable> tables;
  for (const PublishedTable& published : paper.tables)
    tables.push_back(TableMaker(paper, published, runs).make());
  tables.push_back(cost_table(paper, runs));
  return tables;
}

void to_json(nlohmann::json& json, const PaperRun& run) {
  json = {{"preset", run.preset}, {"sequence", run.sequence}, {"first_frame", run.first}};
  if (run.evaluation) {
    json.update(nlohmann::json(*run.evaluation));
    json["tracking_mean_ms"] = run.tracking_ms;
    json["total_mean_ms"] = run.total_ms;
    if (!run.detector.empty()) json["detector"] = run.detector;
  } else {
    json["problem"] = run.problem;
  }
}

}  // namespace stillmap
