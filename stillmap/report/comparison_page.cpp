// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/comparison_page.hpp"

#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/report/chart.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/report/html_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kWidth = 1000, kRow = 30;  // pixels
constexpr double kSmallestError = 1e-5;     // start of the logarithmic axes [m]
/// Colors of the runs, legible on white and on black (Okabe and Ito, Color Universal Design, 2008).
constexpr std::array<const char*, 8> kColors{"#0072b2", "#e69f00", "#009e73", "#d55e00",
                                             "#cc79a7", "#56b4e9", "#8c8c8c", "#b3a100"};

const char* color_of(std::size_t run) { return kColors[run % kColors.size()]; }

std::string name_of(const ComparedRun& run) {
  return run.sequence.empty() ? run.name : run.name + ", " + run.sequence;
}

double logarithm(double error) { return std::log10(std::max(error, kSmallestError)); }

std::vector<double> errors_of(const ComparedRun& run) {
  std::vector<double> errors;
  if (!run.evaluation) return errors;
  for (const AtePair& pair : run.evaluation->ate.pairs) errors.push_back(pair.error);
  return errors;
}

/// Returns the logarithms of the smallest and the largest drawn error of all runs.
ValueRange error_range(const Comparison& comparison) {
  ValueRange range;
  for (const ComparedRun& run : comparison.runs) {
    const std::vector<double> errors = errors_of(run);
    if (errors.empty()) continue;
    range.include(logarithm(quantile(errors, 0.02)));
    range.include(logarithm(quantile(errors, 1)));
  }
  if (range.empty()) range = {-3, -1};
  return range.grown(0.05 * std::max(range.size(), 0.2));
}

void draw_box(Svg& svg, const ChartArea& area, std::span<const double> errors, double y,
              const std::string& color) {
  const auto x = [&](double share) { return area.px(logarithm(quantile(errors, share))); };
  const std::string stroke = "stroke:" + color + ";stroke-width:1.5";
  svg.polyline(std::array<Eigen::Vector2d, 2>{{{x(0.05), y}, {x(0.95), y}}}, "estimate", stroke);
  for (const double end : {0.05, 0.95})
    svg.polyline(std::array<Eigen::Vector2d, 2>{{{x(end), y - 6}, {x(end), y + 6}}}, "estimate",
                 stroke);
  svg.rectangle(x(0.25), y - 9, std::max(1.0, x(0.75) - x(0.25)), 18, "box",
                fmt::format("quartiles {:.4f}, {:.4f}, {:.4f} m; 5 % {:.4f}, 95 % {:.4f} m",
                            quantile(errors, 0.25), quantile(errors, 0.5), quantile(errors, 0.75),
                            quantile(errors, 0.05), quantile(errors, 0.95)),
                "fill:" + color);
  svg.polyline(std::array<Eigen::Vector2d, 2>{{{x(0.5), y - 9}, {x(0.5), y + 9}}}, "median");
}

void draw_boxes(Svg& svg, const ChartArea& area, const Comparison& comparison) {
  draw_logarithmic_x_axis(svg, area, "absolute error [m]");
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const double y = area.top + kRow * (static_cast<double>(i) + 0.5);
    svg.text({area.left - 10, y + 4}, shortened(name_of(comparison.runs[i]), 40), "end");
    const std::vector<double> errors = errors_of(comparison.runs[i]);
    if (errors.empty()) {
      svg.text({area.left + 10, y + 4}, "not evaluated", "start");
    } else {
      draw_box(svg, area, errors, y, color_of(i));
    }
  }
}

double start_of(const ComparedRun& run) {
  return run.truth.empty() ? 0 : run.truth.front().timestamp;
}

void draw_curve(Svg& svg, const ChartArea& area, const ComparedRun& run, const char* color) {
  std::vector<double> stamps;
  std::vector<Eigen::Vector2d> curve;
  for (const AtePair& pair : run.evaluation->ate.pairs) {
    stamps.push_back(pair.timestamp);
    curve.push_back(area.pixel({pair.timestamp - start_of(run), logarithm(pair.error)}));
  }
  for (const auto& [first, end] : continuous_ranges(stamps))
    svg.polyline(std::span(curve).subspan(first, end - first), "curve",
                 std::string("stroke:") + color);
}

void draw_curves(Svg& svg, const ChartArea& area, const Comparison& comparison) {
  draw_x_axis(svg, area, 10, "time [s]");
  draw_logarithmic_y_axis(svg, area, "absolute error [m]");
  svg.begin_clip(area.left, area.top, area.width, area.height);
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    if (comparison.runs[i].evaluation) draw_curve(svg, area, comparison.runs[i], color_of(i));
  }
  svg.end_clip();
  svg.rectangle(area.left, area.top, area.width, area.height, "frame");
}

std::string html_table(const FigureTable& table) {
  std::string html =
      "<h3>" + escape_markup(table.title) + "</h3>\n<div class=\"scroll\"><table><tr>";
  for (const std::string& column : table.columns) html += "<th>" + escape_markup(column) + "</th>";
  html += "</tr>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (const FigureCell& cell : row) html += "<td>" + escape_markup(cell.shown()) + "</td>";
    html += "</tr>\n";
  }
  html += "</table></div>\n";
  for (const std::string& note : table.notes)
    html += "<p class=\"note\">" + escape_markup(note) + "</p>\n";
  return html;
}

std::string tables_card(const Comparison& comparison) {
  std::string html;
  for (const FigureTable& table : comparison_tables(comparison)) html += html_table(table);
  return html_card("Errors", html,
                   "Rigid alignment without scale. Improvement: by how much the figure is smaller "
                   "than that of the first run. Frames: tracked and all.");
}

}  // namespace

Svg error_distribution_chart(const Comparison& comparison) {
  constexpr double kTop = 8, kAxis = 64, kCurves = 260, kRight = 16, kLeft = 70;  // pixels
  constexpr double kCharacter = 7.4;
  std::size_t longest = 8;
  double duration = 1e-3;
  for (const ComparedRun& run : comparison.runs) {
    longest = std::max(longest, std::min<std::size_t>(40, name_of(run).size()));
    if (run.truth.empty()) continue;
    duration = std::max(duration, run.truth.back().timestamp - run.truth.front().timestamp);
  }
  const ValueRange errors = error_range(comparison);
  const double height = kRow * static_cast<double>(comparison.runs.size());
  const double names = 14 + kCharacter * static_cast<double>(longest);
  const ChartArea boxes{names, kTop, kWidth - names - kRight, height, errors, {0, 1}};
  const ChartArea curves{kLeft,   kTop + height + kAxis, kWidth - kLeft - kRight,
                         kCurves, {0, duration},         errors};
  Svg svg(kWidth, curves.bottom() + 52, "absolute error of each run, and over time");
  draw_boxes(svg, boxes, comparison);
  draw_curves(svg, curves, comparison);
  return svg;
}

std::string comparison_page(const Comparison& comparison, const std::vector<std::string>& files) {
  std::string links;
  for (const std::string& file : files)
    links += fmt::format("<a class=\"chip\" href=\"{0}\">{0}</a>\n", escape_markup(file));
  const std::string body =
      fmt::format(
          "<header><h1>Comparison of {} runs</h1>\n<div class=\"chips\">\n{}</div></header>\n",
          comparison.runs.size(), links) +
      tables_card(comparison) +
      html_card("Distribution of the error, and error over time",
                wide_chart(error_distribution_chart(comparison).element()),
                "Box: quartiles and median; whiskers: 5 % and 95 % quantiles. The colors are the "
                "same in both charts.") +
      html_card("Paths from above", wide_chart(comparison_chart(comparison).element()));
  return html_page("Stillmap: comparison", body,
                   "Made by Stillmap. Error figures cover tracked frames only: compare them "
                   "together with the coverage.");
}

}  // namespace stillmap
