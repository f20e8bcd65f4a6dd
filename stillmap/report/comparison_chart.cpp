// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/comparison_chart.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/report/chart.hpp"
#include "stillmap/report/raster.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kPanelWidth = 640, kPanelHeight = 620, kLegendHeight = 48;  // pixels
constexpr double kSmallPanel = 420;  // width and height of the panel of run_paths_chart() [pixels]
constexpr double kLeft = 74, kRight = 18, kTop = 70, kBottom = 56;  // margins of a panel [pixels]
constexpr double kCharacter = 13.9;  // width of a wide character of a heading [pixels]

/// Part of a drawing that shows one run [pixels].
struct Panel {
  Eigen::Vector2d corner;
  double width = kPanelWidth, height = kPanelHeight;
};

ChartArea area_of(const ComparedRun& run, const ProjectionPlane& plane, const Panel& panel) {
  ChartArea area{panel.corner.x() + kLeft,
                 panel.corner.y() + kTop,
                 panel.width - kLeft - kRight,
                 panel.height - kTop - kBottom,
                 {},
                 {}};
  const auto include = [&](const Eigen::Vector3d& p) {
    area.x.include(plane(p).x());
    area.y.include(plane(p).y());
  };
  for (const auto& [stamp, T] : run.truth) include(T.translation());
  if (run.evaluation) {
    for (const AtePair& pair : run.evaluation->ate.pairs) include(pair.p_estimate);
  }
  if (area.x.empty()) area.x = area.y = {-1, 1};
  area.fit_equal_scale();
  return area;
}

void draw_estimate(Canvas& canvas, const ChartArea& area, const ProjectionPlane& plane,
                   const std::vector<AtePair>& pairs) {
  std::vector<double> stamps;
  std::vector<Eigen::Vector2d> path;
  for (const AtePair& pair : pairs) {
    stamps.push_back(pair.timestamp);
    path.push_back(area.pixel(plane(pair.p_estimate)));
    canvas.line(area.pixel(plane(pair.p_truth)), path.back(), "error");
  }
  for (const auto& [first, end] : continuous_ranges(stamps))
    canvas.polyline(std::span(path).subspan(first, end - first), "path");
}

void draw_titles(Canvas& canvas, const ComparedRun& run, const Panel& panel) {
  const double middle = panel.corner.x() + panel.width / 2, top = panel.corner.y();
  const auto length = static_cast<std::size_t>(panel.width / kCharacter);
  canvas.text({middle, top + 32}, shortened(shown_name(run, ", "), length), "middle", "heading");
  std::string figures = "not evaluated";
  if (run.evaluation) {
    const Coverage& coverage = run.evaluation->coverage;
    figures = fmt::format("ATE RMSE {:.4f} m, {}/{} frames", run.evaluation->ate.translation.rmse,
                          coverage.tracked, coverage.total);
  }
  canvas.text({middle, top + 56}, figures, "middle");
}

void draw_panel(Canvas& canvas, const ComparedRun& run, const Panel& panel) {
  const ProjectionPlane plane = plane_from_above(up_axis(run.truth));
  const ChartArea area = area_of(run, plane, panel);
  draw_titles(canvas, run, panel);
  draw_axes(canvas, area, plane);
  canvas.begin_clip(area.left, area.top, area.width, area.height);
  std::vector<Eigen::Vector2d> truth;
  for (const auto& [stamp, T] : run.truth) truth.push_back(area.pixel(plane(T.translation())));
  canvas.polyline(truth, "truth");
  if (run.evaluation) draw_estimate(canvas, area, plane, run.evaluation->ate.pairs);
  canvas.end_clip();
  canvas.rectangle(area.left, area.top, area.width, area.height, "frame");
}

void draw_legend(Canvas& canvas, double width, double y) {
  constexpr std::array<std::array<const char*, 2>, 3> kEntries{
      {{"truth", "ground truth"}, {"path", "estimate, aligned"}, {"error", "error"}}};
  constexpr double kEntryWidth = 190, kStroke = 40;
  double x = std::max(kLeft, (width - kEntryWidth * kEntries.size()) / 2);
  for (const auto& [css_class, name] : kEntries) {
    canvas.line({x, y - 4}, {x + kStroke, y - 4}, css_class);
    canvas.text({x + kStroke + 10, y}, name, "start");
    x += kEntryWidth;
  }
}

std::vector<std::string> distinct(const Comparison& comparison, std::string ComparedRun::*member) {
  std::vector<std::string> values;
  for (const ComparedRun& run : comparison.runs) {
    if (std::find(values.begin(), values.end(), run.*member) == values.end()) {
      values.push_back(run.*member);
    }
  }
  return values;
}

struct Cell {
  int row = 0, column = 0;
};

/// Returns the position of each run's panel: one row per sequence and one column per system if
/// there are several of both and no pair occurs twice; otherwise row by row, with at most three
/// columns.
std::vector<Cell> lay_out(const Comparison& comparison) {
  const auto names = distinct(comparison, &ComparedRun::name);
  const auto sequences = distinct(comparison, &ComparedRun::sequence);
  const auto position = [](const std::vector<std::string>& values, const std::string& value) {
    return static_cast<int>(std::find(values.begin(), values.end(), value) - values.begin());
  };
  std::vector<Cell> cells;
  if (names.size() > 1 && sequences.size() > 1) {
    for (const ComparedRun& run : comparison.runs) {
      cells.push_back({position(sequences, run.sequence), position(names, run.name)});
    }
    auto sorted = cells;
    const auto order = [](Cell a, Cell b) {
      return std::pair(a.row, a.column) < std::pair(b.row, b.column);
    };
    std::sort(sorted.begin(), sorted.end(), order);
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end(), [](Cell a, Cell b) {
      return a.row == b.row && a.column == b.column;
    });
    if (twice == sorted.end()) return cells;
    cells.clear();
  }
  const int count = static_cast<int>(comparison.runs.size());
  const int columns = count == 4 ? 2 : std::min(count, 3);
  for (int i = 0; i < count; ++i) cells.push_back({i / columns, i % columns});
  return cells;
}

/// Size of a drawing [pixels].
struct DrawingSize {
  double width = 0, height = 0;
};

DrawingSize size_of(const std::vector<Cell>& cells) {
  if (cells.empty()) {
    throw Error("there is no run to draw", "comparison", "name at least one trajectory");
  }
  Cell last;
  for (const Cell& cell : cells) {
    last = {std::max(last.row, cell.row), std::max(last.column, cell.column)};
  }
  return {(last.column + 1) * kPanelWidth, (last.row + 1) * kPanelHeight + kLegendHeight};
}

void draw(const Comparison& comparison, const std::vector<Cell>& cells, Canvas& canvas) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    draw_panel(canvas, comparison.runs[i],
               {{cells[i].column * kPanelWidth, cells[i].row * kPanelHeight}});
  }
  const DrawingSize size = size_of(cells);
  draw_legend(canvas, size.width, size.height - kLegendHeight / 2);
}

}  // namespace

Svg comparison_chart(const Comparison& comparison) {
  const std::vector<Cell> cells = lay_out(comparison);
  const DrawingSize size = size_of(cells);
  Svg svg(size.width, size.height, "estimated and true paths from above");
  draw(comparison, cells, svg);
  return svg;
}

Svg run_paths_chart(const ComparedRun& run) {
  Svg svg(kSmallPanel, kSmallPanel, "estimated and true path from above: " + run.name);
  draw_panel(svg, run, {{0, 0}, kSmallPanel, kSmallPanel});
  return svg;
}

cv::Mat comparison_image(const Comparison& comparison) {
  const std::vector<Cell> cells = lay_out(comparison);
  const DrawingSize size = size_of(cells);
  Raster raster(size.width, size.height);
  draw(comparison, cells, raster);
  return raster.image();
}

}  // namespace stillmap
