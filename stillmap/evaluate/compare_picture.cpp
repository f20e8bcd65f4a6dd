// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/canvas.hpp"
#include "stillmap/evaluate/compare.hpp"
#include "stillmap/evaluate/plot.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {
namespace {

const cv::Scalar kPaper(255, 255, 255), kInk(35, 30, 28), kSoftInk(110, 102, 96),
    kTruth(20, 18, 16), kEstimate(200, 90, 20), kError(60, 55, 225);

/// Layout of one panel, in parts of its width.
struct PanelShape {
  double left = 0.115, right = 0.03, top = 0.125, bottom = 0.115;  // around the plot
  double cap = 0.0165;                                             // capitals of labels
};

/// Positions and where the path is interrupted (tracking lost).
void draw_path(Canvas& canvas, const Plot& plot, const PaperPlane& plane,
               const std::vector<AtePair>& pairs, double thickness) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    gaps.push_back(pairs[i].timestamp - pairs[i - 1].timestamp);
  }
  const double longest = 3.5 * quantile(gaps, 0.5);
  std::vector<cv::Point2d> part;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0 && pairs[i].timestamp - pairs[i - 1].timestamp > longest) {
      canvas.polyline(part, kEstimate, thickness);
      part.clear();
    }
    part.push_back(plot(plane(pairs[i].p_estimate)));
  }
  canvas.polyline(part, kEstimate, thickness);
}

void draw_curves(Canvas& canvas, const Plot& plot, const PaperPlane& plane, const ComparedRun& run,
                 double thickness) {
  canvas.clip(plot.area());
  if (run.evaluation) {
    for (const AtePair& pair : run.evaluation->ate.pairs) {
      canvas.line(plot(plane(pair.p_truth)), plot(plane(pair.p_estimate)), kError, 0.7 * thickness);
    }
  }
  std::vector<cv::Point2d> truth(run.p_truth.size());
  std::transform(run.p_truth.begin(), run.p_truth.end(), truth.begin(),
                 [&](const Eigen::Vector3d& p) { return plot(plane(p)); });
  canvas.polyline(truth, kTruth, thickness);
  if (run.evaluation) draw_path(canvas, plot, plane, run.evaluation->ate.pairs, thickness);
  canvas.clip({});
}

Plot make_plot(const cv::Rect2d& area, const PaperPlane& plane, const ComparedRun& run) {
  Range x, y;
  const auto include = [&](const Eigen::Vector3d& p) {
    x.include(plane(p).x());
    y.include(plane(p).y());
  };
  std::for_each(run.p_truth.begin(), run.p_truth.end(), include);
  if (run.evaluation) {
    for (const AtePair& pair : run.evaluation->ate.pairs) include(pair.p_estimate);
  }
  if (x.empty()) x = y = {-1, 1};
  return {area, x, y};
}

void draw_titles(Canvas& canvas, const ComparedRun& run, const cv::Point2d& corner, double width,
                 double cap) {
  const std::string title = run.sequence.empty() ? run.name : run.name + ", " + run.sequence;
  canvas.text(title, {corner.x + width / 2, corner.y + 2.9 * cap}, 1.3 * cap, kInk, Anchor::kCenter,
              true);
  std::string figures = "not evaluated";
  if (run.evaluation) {
    const Coverage& coverage = run.evaluation->coverage;
    figures = fmt::format("ATE RMSE {:.4f} m,  {}/{} frames", run.evaluation->ate.translation.rmse,
                          coverage.tracked, coverage.total);
  }
  canvas.text(figures, {corner.x + width / 2, corner.y + 5.5 * cap}, cap, kSoftInk,
              Anchor::kCenter);
}

void draw_panel(Canvas& canvas, const ComparedRun& run, const cv::Rect2d& panel) {
  const PanelShape shape;
  const double w = panel.width, cap = shape.cap * w;
  const cv::Rect2d area(panel.x + shape.left * w, panel.y + shape.top * w,
                        w * (1 - shape.left - shape.right),
                        panel.height - w * (shape.top + shape.bottom));
  const PaperPlane plane = plane_from_above(run.up_axis);
  const Plot plot = make_plot(area, plane, run);
  draw_titles(canvas, run, {area.x, panel.y}, area.width, cap);
  draw_x_axis(canvas, plot, plane.right, cap);
  draw_y_axis(canvas, plot, plane.up, cap);
  draw_curves(canvas, plot, plane, run, w / 420);
  canvas.rectangle(area, kSoftInk, 1.2);
}

void draw_legend(Canvas& canvas, double width, double y, double cap) {
  const std::vector<std::pair<std::string, cv::Scalar>> entries{
      {"ground truth", kTruth}, {"estimate, aligned", kEstimate}, {"error", kError}};
  const double stroke = 4.5 * cap, gap = cap, space = 4 * cap;
  double total = -space;
  for (const auto& [name, color] : entries) {
    total += stroke + gap + Canvas::text_width(name, cap) + space;
  }
  double x = (width - total) / 2;
  for (const auto& [name, color] : entries) {
    canvas.line({x, y - cap / 2}, {x + stroke, y - cap / 2}, color, cap / 4);
    canvas.text(name, {x + stroke + gap, y}, cap, kInk);
    x += stroke + gap + Canvas::text_width(name, cap) + space;
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

/// Sequences by systems where both are several and no pair comes twice; else line by line, at most
/// three columns.
std::vector<Cell> lay_out(const Comparison& comparison) {
  const auto names = distinct(comparison, &ComparedRun::name);
  const auto sequences = distinct(comparison, &ComparedRun::sequence);
  const auto place = [](const std::vector<std::string>& values, const std::string& value) {
    return static_cast<int>(std::find(values.begin(), values.end(), value) - values.begin());
  };
  std::vector<Cell> cells;
  if (names.size() > 1 && sequences.size() > 1) {
    for (const ComparedRun& run : comparison.runs) {
      cells.push_back({place(sequences, run.sequence), place(names, run.name)});
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

}  // namespace

cv::Mat draw_comparison(const Comparison& comparison, int panel_width) {
  if (comparison.runs.empty()) {
    throw Error("there is no run to draw", "comparison", "name at least one trajectory");
  }
  const std::vector<Cell> cells = lay_out(comparison);
  Cell last;
  for (const Cell& cell : cells) {
    last = {std::max(last.row, cell.row), std::max(last.column, cell.column)};
  }
  const int panel_height = panel_width * 24 / 25;
  const int legend_height = panel_width * 3 / 40;
  const int width = (last.column + 1) * panel_width;
  const int height = (last.row + 1) * panel_height + legend_height;
  Canvas canvas(width, height, kPaper);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    draw_panel(canvas, comparison.runs[i],
               cv::Rect2d(cells[i].column * panel_width, cells[i].row * panel_height, panel_width,
                          panel_height));
  }
  draw_legend(canvas, width, height - 0.45 * legend_height, PanelShape().cap * panel_width);
  return canvas.finished();
}

void write_comparison_picture(const std::filesystem::path& file, const Comparison& comparison) {
  std::vector<unsigned char> png;
  cv::imencode(".png", draw_comparison(comparison), png);
  write_file(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace stillmap
