// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/comparison_chart.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/report/chart.hpp"

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

void draw_estimate(Svg& svg, const ChartArea& area, const ProjectionPlane& plane,
                   const std::vector<AtePair>& pairs) {
  std::vector<double> stamps;
  std::vector<Eigen::Vector2d> path;
  for (const AtePair& pair : pairs) {
    stamps.push_back(pair.timestamp);
    path.push_back(area.pixel(plane(pair.p_estimate)));
    svg.line(area.pixel(plane(pair.p_truth)), path.back(), "error");
  }
  for (const auto& [first, end] : continuous_ranges(stamps))
    svg.polyline(std::span(path).subspan(first, end - first), "path");
}

void draw_titles(Svg& svg, const ComparedRun& run, const Panel& panel) {
  const double middle = panel.corner.x() + panel.width / 2, top = panel.corner.y();
  const auto length = static_cast<std::size_t>(panel.width / kCharacter);
  svg.text({middle, top + 32}, shortened(shown_name(run, ", "), length), "middle", "heading");
  std::string figures = "not evaluated";
  if (run.evaluation) {
    const Coverage& coverage = run.evaluation->coverage;
    figures = fmt::format("ATE RMSE {:.4f} m, {}/{} frames", run.evaluation->ate.translation.rmse,
                          coverage.tracked, coverage.total);
  }
  svg.text({middle, top + 56}, figures, "middle");
}

void draw_panel(Svg& svg, const ComparedRun& run, const Panel& panel) {
  const ProjectionPlane plane = plane_from_above(up_axis(run.truth));
  const ChartArea area = area_of(run, plane, panel);
  draw_titles(svg, run, panel);
  draw_axes(svg, area, plane);
  svg.begin_clip(area.left, area.top, area.width, area.height);
  std::vector<Eigen::Vector2d> truth;
  for (const auto& [stamp, T] : run.truth) truth.push_back(area.pixel(plane(T.translation())));
  svg.polyline(truth, "truth");
  if (run.evaluation) draw_estimate(svg, area, plane, run.evaluation->ate.pairs);
  svg.end_clip();
  svg.rectangle(area.left, area.top, area.width, area.height, "frame");
}

void draw_legend(Svg& svg, double width, double y) {
  constexpr std::array<std::array<const char*, 2>, 3> kEntries{
      {{"truth", "ground truth"}, {"path", "estimate, aligned"}, {"error", "error"}}};
  constexpr double kEntryWidth = 190, kStroke = 40;
  double x = std::max(kLeft, (width - kEntryWidth * kEntries.size()) / 2);
  for (const auto& [css_class, name] : kEntries) {
    svg.line({x, y - 4}, {x + kStroke, y - 4}, css_class);
    svg.text({x + kStroke + 10, y}, name, "start");
    x += kEntryWidth;
  }
}

}  // namespace

Svg comparison_chart(const Comparison& comparison) {
  const int count = static_cast<int>(comparison.runs.size());
  if (count == 0) {
    throw Error("there is no run to draw", "comparison", "name at least one trajectory");
  }
  const int columns = count == 4 ? 2 : std::min(count, 3), rows = (count + columns - 1) / columns;
  const double width = columns * kPanelWidth, height = rows * kPanelHeight + kLegendHeight;
  Svg svg(width, height, "estimated and true paths from above");
  for (int i = 0; i < count; ++i) {
    draw_panel(svg, comparison.runs[static_cast<std::size_t>(i)],
               {{i % columns * kPanelWidth, i / columns * kPanelHeight}});
  }
  draw_legend(svg, width, height - kLegendHeight / 2);
  return svg;
}

Svg run_paths_chart(const ComparedRun& run) {
  Svg svg(kSmallPanel, kSmallPanel, "estimated and true path from above: " + run.name);
  draw_panel(svg, run, {{0, 0}, kSmallPanel, kSmallPanel});
  return svg;
}

}  // namespace stillmap
