// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/paper_tables.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/evaluate/compare.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>

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
  if (measure == PaperMeasure::kTrackingTime)
    return run.timed ? std::optional(run.tracking_ms) : std::nullopt;
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

using FigureOfRun = std::function<std::optional<double>(const PaperRun&)>;

/// Returns the mean of a figure over the runs of a preset on a sequence; none without a run, or if
/// one of the runs lacks it.
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

/// Returns the mean of the cells; an empty cell if one of them is empty.
FigureCell mean_of_cells(const std::vector<FigureCell>& cells) {
  double sum = 0;
  for (const FigureCell& cell : cells) {
    if (!cell.value) return {};
    sum += *cell.value;
  }
  return {sum / static_cast<double>(cells.size()), cells.front().decimals};
}

std::optional<double> with_network_ms_of(const PaperRun& run) {
  return run.timed ? std::optional(run.tracking_ms + run.waiting_ms) : std::nullopt;
}

/// Returns a note for each run without a pose for many frames, which its error does not contain.
std::vector<std::string> incomplete_runs(std::span<const PaperRun> runs) {
  constexpr double kFew = 0.95;
  std::vector<std::string> notes;
  for (const PaperRun& run : runs) {
    if (!run.evaluation || run.evaluation->coverage.share() >= kFew) continue;
    notes.push_back(
        fmt::format("{} has poses for {:.1f} % of the frames of {} (run from frame {}): "
                    "its error is that of these frames only.",
                    run.preset, 100 * run.evaluation->coverage.share(), run.sequence, run.first));
  }
  return notes;
}

/// Name prefixes of the sequences in which people walk.
constexpr std::array kWalking{"walking_", "kitchen_walking_"};

/// Makes one table of a paper.
class TableMaker {
 public:
  TableMaker(const Paper& paper, const PublishedTable& published, std::span<const PaperRun> runs,
             const Comparands& comparands)
      : paper_(paper), published_(published), runs_(runs), reference_(comparands.reference) {
    systems_ = {paper.preset, kOwnSystem};
    systems_.insert(systems_.end(), comparands.others.begin(), comparands.others.end());
  }

  FigureTable make() const {
    FigureTable table;
    table.title = fmt::format("{}, {}: {}", paper_.preset, place(), title_of(published_.measure));
    table.columns = columns();
    for (const std::string& sequence : sequences_of(paper_, runs_)) {
      if (!has_figures(sequence)) continue;
      for (const std::string& statistic : published_.statistics)
        table.rows.push_back(row(sequence, statistic));
    }
    if (times()) {
      add_means("the paper's sequences", table,
                [&](const std::string& sequence) { return published_.rows.contains(sequence); });
    } else {
      for (const std::string prefix : kWalking) {
        add_means(prefix + "*", table,
                  [&](const std::string& sequence) { return sequence.starts_with(prefix); });
      }
    }
    if (!published_.remark.empty()) table.notes.push_back(published_.remark);
    if (has_means(table) && !published_.systems.empty())
      table.notes.emplace_back("Published means are those of the published figures.");
    if (!times()) std::ranges::copy(incomplete_runs(runs_), std::back_inserter(table.notes));
    return table;
  }

 private:
  bool compares() const { return published_.measure == PaperMeasure::kAteImprovement; }
  /// Improvement rates are for errors: a time depends on the computer and on what else it does.
  bool improves() const { return !compares() && published_.measure != PaperMeasure::kTrackingTime; }
  bool times() const { return published_.measure == PaperMeasure::kTrackingTime; }
  bool publishes(const std::string& system) const {
    const auto& systems = published_.systems;
    return std::find(systems.begin(), systems.end(), system) != systems.end();
  }
  static bool has_means(const FigureTable& table) {
    return std::any_of(table.rows.begin(), table.rows.end(),
                       [](const auto& row) { return row[0].text.starts_with("mean of "); });
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
    for (const std::string& system : systems_) {
      names.push_back(system);
      if (improves()) names.push_back(system + " improved [%]");
      if (times()) names.push_back(system + " with the detector");
    }
    for (const std::string& system : published_.systems) names.push_back("published: " + system);
    if (publishes_improvement()) names.emplace_back("improved, from the published [%]");
    return names;
  }

  /// Returns the mean over the runs of a system, with the value of each run.
  FigureCell measured(const std::string& system, const std::string& sequence,
                      const std::string& statistic) const {
    const PaperMeasure measure = compares() ? PaperMeasure::kAte : published_.measure;
    FigureCell cell(mean_over_runs(runs_, system, sequence, measure, statistic),
                    decimals_of(published_.measure));
    if (!cell.value || times()) return cell;
    for (const PaperRun& run : runs_) {
      if (run.preset == system && run.sequence == sequence)
        cell.runs.push_back(figure_of(run, measure, statistic).value());
    }
    return cell;
  }

  std::vector<FigureCell> row(const std::string& sequence, const std::string& statistic) const {
    const int decimals = decimals_of(published_.measure);
    std::vector<FigureCell> cells{sequence, shown_name(statistic)};
    const auto reference = measured(reference_, sequence, statistic).value;
    if (!compares()) cells.push_back(measured(kPaperBaseline, sequence, statistic));
    for (const std::string& system : systems_) {
      const FigureCell figure = measured(system, sequence, statistic);
      if (!compares()) cells.push_back(figure);
      if (compares() || improves())
        cells.emplace_back(improvement(reference, figure.value), kPercentDecimals);
      if (times())
        cells.emplace_back(mean_of(runs_, system, sequence, with_network_ms_of), decimals);
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

  /// Adds rows with the means over these sequences if there are several. A mean is left empty if a
  /// sequence has no value.
  void add_means(const std::string& name, FigureTable& table,
                 const std::function<bool(const std::string& sequence)>& is_one) const {
    for (const std::string& statistic : published_.statistics) {
      std::vector<std::vector<FigureCell>> columns(table.columns.size());
      for (const auto& row : table.rows) {
        if (!is_one(row[0].text) || row[1].text != shown_name(statistic)) continue;
        for (std::size_t i = 0; i < row.size(); ++i) columns[i].push_back(row[i]);
      }
      if (columns[0].size() < 2) continue;
      std::vector<FigureCell> means{"mean of " + name, shown_name(statistic)};
      for (std::size_t i = means.size(); i < columns.size(); ++i)
        means.push_back(mean_of_cells(columns[i]));
      table.rows.push_back(std::move(means));
    }
  }

  const Paper& paper_;
  const PublishedTable& published_;
  std::span<const PaperRun> runs_;
  std::string reference_;
  std::vector<std::string> systems_;  // all columns but the baseline
};

std::optional<double> tracking_ms_of(const PaperRun& run) {
  return run.timed ? std::optional(run.tracking_ms) : std::nullopt;
}
std::optional<double> total_ms_of(const PaperRun& run) {
  return run.timed ? std::optional(run.total_ms) : std::nullopt;
}
std::optional<double> tracked_percent_of(const PaperRun& run) {
  return 100 * run.evaluation->coverage.share();
}
std::optional<double> highly_dynamic_percent_of(const PaperRun& run) {
  return run.highly_dynamic ? std::optional(100 * *run.highly_dynamic) : std::nullopt;
}
std::optional<double> map_points_of(const PaperRun& run) {
  return run.map ? std::optional(static_cast<double>(run.map->points)) : std::nullopt;
}
std::optional<double> ghosts_of(const PaperRun& run) {
  return run.map ? std::optional(static_cast<double>(run.map->ghosts)) : std::nullopt;
}
std::optional<double> kept_percent_of(const PaperRun& run) {
  return run.map ? std::optional(100 * run.map->surface_share()) : std::nullopt;
}
std::optional<double> rpe_second_mm_of(const PaperRun& run) {
  const auto rpe = figure_of(run, PaperMeasure::kRpeSecondTranslation, "rmse");
  return rpe ? std::optional(1000 * *rpe) : std::nullopt;
}
std::optional<double> rpe_frame_mm_of(const PaperRun& run) {
  const auto rpe = figure_of(run, PaperMeasure::kRpeFrameTranslation, "rmse");
  return rpe ? std::optional(1000 * *rpe) : std::nullopt;
}

/// A figure of a run with its name in the tables.
struct NamedFigure {
  const char* key;
  const char* title;
  std::optional<double> (*of)(const PaperRun&);
  int decimals;
};
constexpr std::array kCosts{
    NamedFigure{"tracking", "tracking [ms]", tracking_ms_of, 1},
    NamedFigure{"with_network", "tracking with the detector [ms]", with_network_ms_of, 1},
    NamedFigure{"total", "whole system [ms]", total_ms_of, 1},
    NamedFigure{"tracked", "frames tracked [%]", tracked_percent_of, 1},
    NamedFigure{"dynamic", "highly dynamic frames [%]", highly_dynamic_percent_of, 1},
    NamedFigure{"map_points", "points of the dense map", map_points_of, 0},
    NamedFigure{"ghosts", "ghosts among them", ghosts_of, 0},
    NamedFigure{"kept", "static surface in the dense map [%]", kept_percent_of, 1}};
constexpr std::array kRelativeErrors{
    NamedFigure{"rpe_1s", "RPE RMSE over 1 s [mm]", rpe_second_mm_of, 1},
    NamedFigure{"rpe_frame", "RPE RMSE from frame to frame [mm]", rpe_frame_mm_of, 1}};

bool has_values(const std::vector<FigureCell>& row) {
  return std::any_of(row.begin(), row.end(), [](const auto& cell) { return cell.value; });
}

/// Returns a table with a row per system and a column per sequence. Systems without a value are
/// left out.
FigureTable system_table(
    const std::string& title, const std::vector<std::string>& sequences,
    const std::vector<std::string>& systems,
    const std::function<FigureCell(const std::string& system, const std::string& sequence)>& cell) {
  FigureTable table;
  table.title = title;
  table.columns = {"system"};
  table.columns.insert(table.columns.end(), sequences.begin(), sequences.end());
  for (const std::string& system : systems) {
    std::vector<FigureCell> row{system};
    for (const std::string& sequence : sequences) row.push_back(cell(system, sequence));
    const bool empty = std::all_of(row.begin() + 1, row.end(), [](const FigureCell& figure) {
      return !figure.value && figure.text.empty();
    });
    if (!empty) table.rows.push_back(std::move(row));
  }
  return table;
}

/// Removes the columns without a value, except the first one.
void remove_empty_columns(FigureTable& table) {
  for (std::size_t i = table.columns.size(); i-- > 1;) {
    const bool empty = std::none_of(table.rows.begin(), table.rows.end(),
                                    [&](const auto& row) { return row[i].value.has_value(); });
    if (!empty || table.rows.empty()) continue;
    table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(i));
    for (auto& row : table.rows) row.erase(row.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

FigureTable cost_table(const Paper& paper, std::span<const PaperRun> runs,
                       const Comparands& comparands) {
  std::vector<std::string> presets{kPaperBaseline, paper.preset, kOwnSystem};
  presets.insert(presets.end(), comparands.others.begin(), comparands.others.end());
  FigureTable table;
  table.title = paper.preset + ": time per frame, and frames tracked";
  table.columns = {"sequence"};
  for (const NamedFigure& cost : kCosts) {
    for (const std::string& preset : presets)
      table.columns.push_back(fmt::format("{}, {}", preset, cost.title));
  }
  for (const std::string& sequence : sequences_of(paper, runs)) {
    std::vector<FigureCell> row{sequence};
    for (const NamedFigure& cost : kCosts) {
      for (const std::string& preset : presets)
        row.emplace_back(mean_of(runs, preset, sequence, cost.of), cost.decimals);
    }
    if (has_values(row)) table.rows.push_back(std::move(row));
  }
  remove_empty_columns(table);
  table.notes.emplace_back(
      "Tracking: the thread of the camera, without and with waiting for the network. Whole system: "
      "the time of a run divided by its frames, with network, mapping and the final steps.");
  return table;
}

/// Adds columns with the means over the walking sequences, if there are several.
void add_means(FigureTable& table) {
  for (const std::string prefix : kWalking) {
    std::vector<std::size_t> walking;
    for (std::size_t i = 1; i < table.columns.size(); ++i) {
      if (table.columns[i].starts_with(prefix)) walking.push_back(i);
    }
    if (walking.size() < 2) continue;
    table.columns.push_back("mean of " + prefix + "*");
    for (auto& row : table.rows) {
      std::vector<FigureCell> figures;
      for (const std::size_t i : walking) figures.push_back(row[i]);
      row.push_back(mean_of_cells(figures));
    }
  }
}

/// Returns the ATE RMSE of the runs of a system on a sequence [mm]; empty if one has none.
std::vector<double> ates_of(std::span<const PaperRun> runs, const std::string& system,
                            const std::string& sequence) {
  std::vector<double> ates;
  for (const PaperRun& run : runs) {
    if (run.preset != system || run.sequence != sequence) continue;
    if (!run.evaluation) return {};
    ates.push_back(1000 * run.evaluation->ate.translation.rmse);
  }
  return ates;
}

/// Returns "median; worst" of several values, or the only value.
FigureCell median_and_worst(const std::vector<double>& figures) {
  if (figures.size() < 2)
    return {figures.empty() ? std::nullopt : std::optional(figures.front()), 1};
  return fmt::format("{:.1f}; {:.1f}", quantile(figures, 0.5),
                     *std::max_element(figures.begin(), figures.end()));
}

std::vector<std::string> sequences_in(std::span<const PaperRun> runs) {
  std::vector<std::string> sequences;
  for (const PaperRun& run : runs) {
    if (std::find(sequences.begin(), sequences.end(), run.sequence) == sequences.end())
      sequences.push_back(run.sequence);
  }
  return sequences;
}

}  // namespace

std::optional<double> mean_over_runs(std::span<const PaperRun> runs, const std::string& preset,
                                     const std::string& sequence, PaperMeasure measure,
                                     const std::string& statistic) {
  return mean_of(runs, preset, sequence,
                 [&](const PaperRun& run) { return figure_of(run, measure, statistic); });
}

std::vector<FigureTable> paper_tables(const Paper& paper, std::span<const PaperRun> runs,
                                      const Comparands& comparands) {
  std::vector<FigureTable> tables;
  for (const PublishedTable& published : paper.tables)
    tables.push_back(TableMaker(paper, published, runs, comparands).make());
  tables.push_back(cost_table(paper, runs, comparands));
  return tables;
}

std::vector<std::pair<std::string, FigureTable>> summary_tables(
    std::span<const PaperRun> runs, const std::vector<std::string>& systems,
    const std::string& reference) {
  const std::vector<std::string> sequences = sequences_in(runs);
  const auto ate = [&](const std::string& system, const std::string& sequence) {
    return median_and_worst(ates_of(runs, system, sequence));
  };
  const auto rate = [&](const std::string& system, const std::string& sequence) {
    if (system == reference) return FigureCell();
    const auto mean = [&](const std::string& of) {
      return mean_over_runs(runs, of, sequence, PaperMeasure::kAte, "rmse");
    };
    return FigureCell(improvement(mean(reference), mean(system)), 1);
  };
  std::vector<std::pair<std::string, FigureTable>> tables;
  const bool repeated = std::any_of(runs.begin(), runs.end(), [&](const PaperRun& run) {
    return ates_of(runs, run.preset, run.sequence).size() > 1;
  });
  tables.emplace_back(
      "ate", system_table(repeated ? "ATE RMSE [mm]: median; worst of the runs" : "ATE RMSE [mm]",
                          sequences, systems, ate));
  tables.emplace_back("improvement",
                      system_table("ATE RMSE: improvement of the mean over " + reference + " [%]",
                                   sequences, systems, rate));
  add_means(tables.back().second);
  std::vector<NamedFigure> figures(kRelativeErrors.begin(), kRelativeErrors.end());
  figures.insert(figures.end(), kCosts.begin(), kCosts.end());
  for (const NamedFigure& figure : figures) {
    const auto mean = [&](const std::string& system, const std::string& sequence) {
      return FigureCell(mean_of(runs, system, sequence, figure.of), figure.decimals);
    };
    FigureTable table = system_table(figure.title, sequences, systems, mean);
    remove_empty_columns(table);
    if (!table.rows.empty()) tables.emplace_back(figure.key, std::move(table));
  }
  return tables;
}

void to_json(nlohmann::json& json, const PaperRun& run) {
  json = {{"preset", run.preset}, {"sequence", run.sequence}, {"first_frame", run.first}};
  if (run.evaluation) {
    json.update(nlohmann::json(*run.evaluation));
    json["tracking_mean_ms"] = run.tracking_ms;
    json["waiting_mean_ms"] = run.waiting_ms;
    json["total_mean_ms"] = run.total_ms;
    if (run.highly_dynamic) json["highly_dynamic"] = *run.highly_dynamic;
    if (run.map) json["dense_map"] = *run.map;
    if (!run.detector.empty()) json["detector"] = run.detector;
  } else {
    json["problem"] = run.problem;
  }
}

}  // namespace stillmap
