// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/crane_table.hpp"

#include "stillmap/evaluate/closure.hpp"
#include "stillmap/evaluate/compare.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Means over the runs of one preset on one sequence; of none if one of them has no evaluation.
struct CraneFigures {
  std::string sequence, preset;
  int runs = 0;
  double ate = 0, plane = 0, plane_percent = 0, space = 0, tracked = 0, tracking_ms = 0;
  double points = 0, ghosts = 0;
  bool timed = true, has_map = true;  ///< Whether all runs have times, or maps.
  std::vector<double> planes = {};    ///< `plane` of each run.
};

CraneFigures mean_of(std::span<const PaperRun> runs, const std::string& sequence,
                     const std::string& preset) {
  CraneFigures mean{sequence, preset};
  for (const PaperRun& run : runs) {
    if (run.sequence != sequence || run.preset != preset) continue;
    if (!run.evaluation) return {sequence, preset};
    const ClosureError closure = closure_error(run.evaluation->ate);
    ++mean.runs;
    mean.ate += run.evaluation->ate.translation.rmse;
    mean.plane += closure.plane;
    mean.planes.push_back(closure.plane);
    mean.plane_percent += closure.plane_percent();
    mean.space += closure.space;
    mean.tracked += 100 * run.evaluation->coverage.share();
    mean.tracking_ms += run.tracking_ms;
    mean.timed = mean.timed && run.timed;
    mean.has_map = mean.has_map && run.map.has_value();
    if (!run.map) continue;
    mean.points += static_cast<double>(run.map->points);
    mean.ghosts += static_cast<double>(run.map->ghosts);
  }
  for (double* sum : {&mean.ate, &mean.plane, &mean.plane_percent, &mean.space, &mean.tracked,
                      &mean.tracking_ms, &mean.points, &mean.ghosts})
    *sum /= std::max(1, mean.runs);
  return mean;
}

std::optional<double> improvement(const CraneFigures& baseline, const CraneFigures& other) {
  if (baseline.runs == 0 || other.runs == 0 || other.preset == baseline.preset) return std::nullopt;
  return improvement_rate(baseline.plane, other.plane);
}

}  // namespace

FigureTable crane_table(const Paper& paper, std::span<const PaperRun> runs,
                        const std::string& reference) {
  FigureTable table;
  table.title = paper.preset + ", section 4.5: closure error of a crane's camera";
  table.columns = {"sequence",
                   "preset",
                   "closure in the plane [m]",
                   "improved [%]",
                   "closure in the plane [% of the path]",
                   "closure in space [m]",
                   "ATE RMSE [m]",
                   "frames tracked [%]",
                   "tracking [ms]",
                   "points of the map",
                   "ghosts"};
  std::vector<std::pair<std::string, std::string>> shown;
  for (const PaperRun& run : runs) {
    const std::pair key(run.sequence, run.preset);
    if (std::find(shown.begin(), shown.end(), key) != shown.end()) continue;
    shown.push_back(key);
    const CraneFigures mean = mean_of(runs, run.sequence, run.preset);
    const CraneFigures baseline = mean_of(runs, run.sequence, reference);
    const auto cell = [&](double value, int decimals) {
      return FigureCell(mean.runs > 0 ? std::optional(value) : std::nullopt, decimals);
    };
    const auto map_cell = [&](double value) {
      return mean.has_map ? cell(value, 0) : FigureCell();
    };
    FigureCell plane = cell(mean.plane, 4);
    plane.runs = mean.planes;
    table.rows.push_back({run.sequence, run.preset, plane,
                          FigureCell(improvement(baseline, mean), 2), cell(mean.plane_percent, 3),
                          cell(mean.space, 4), cell(mean.ate, 4), cell(mean.tracked, 1),
                          mean.timed ? cell(mean.tracking_ms, 1) : FigureCell(),
                          map_cell(mean.points), map_cell(mean.ghosts)});
  }
  table.notes.push_back(paper.crane);
  return table;
}

}  // namespace stillmap
