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

constexpr double kNarrow = 400;          // width of the charts for telephones [pixels]
constexpr double kCharacter = 9;         // width of a wide character of a label [pixels]
constexpr std::size_t kNameLength = 40;  // longest shown name of a run [characters]
constexpr double kSmallestError = 1e-5;  // start of the logarithmic axes [m]
/// Colors of the runs, legible on white and on black (Okabe and Ito, Color Universal Design, 2008).
constexpr std::array<const char*, 8> kColors{"#0072b2", "#e69f00", "#009e73", "#d55e00",
                                             "#cc79a7", "#56b4e9", "#8c8c8c", "#b3a100"};

const char* color_of(std::size_t run) { return kColors[run % kColors.size()]; }

std::string name_of(const ComparedRun& run) { return shown_name(run, ", "); }

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

/// Arrangement of the box plots and the curves below them [pixels].
struct Layout {
  bool names_above = false;  ///< Whether the names are above the boxes or left of them.
  double row = 30;           ///< Height of the row of a run.
  ChartArea boxes, curves;

  /// Returns the center of the box in a row.
  double center_of(std::size_t run) const {
    return boxes.top + row * (static_cast<double>(run) + (names_above ? 0.68 : 0.5));
  }
};

void draw_boxes(Svg& svg, const Layout& layout, const Comparison& comparison) {
  const ChartArea& area = layout.boxes;
  draw_logarithmic_x_axis(svg, area, "absolute error [m]");
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const double y = layout.center_of(i);
    const std::string name = shortened(name_of(comparison.runs[i]), kNameLength);
    if (layout.names_above) {
      svg.text({area.left, y - 15}, name, "start");
    } else {
      svg.text({area.left - 10, y + 4}, name, "end");
    }
    const std::vector<double> errors = errors_of(comparison.runs[i]);
    if (errors.empty()) {
      svg.text({area.left + 10, y + 4}, "not evaluated", "start");
    } else {
      draw_box(svg, area, errors, y, color_of(i));
    }
  }
}

/// Returns the timestamps of the evaluated poses of all runs of a sequence [s].
ValueRange evaluated_time(const Comparison& comparison, const std::string& sequence) {
  ValueRange time;
  for (const ComparedRun& run : comparison.runs) {
    if (!run.evaluation || run.sequence != sequence || run.evaluation->ate.pairs.empty()) continue;
    time.include(run.evaluation->ate.pairs.front().timestamp);
    time.include(run.evaluation->ate.pairs.back().timestamp);
  }
  return time;
}

/// Returns the longest evaluated time of a sequence [s].
double duration_of(const Comparison& comparison) {
  double duration = 1e-3;
  for (const ComparedRun& run : comparison.runs)
    duration = std::max(duration, evaluated_time(comparison, run.sequence).size());
  return duration;
}

void draw_curve(Svg& svg, const ChartArea& area, const ComparedRun& run, double start,
                const char* color) {
  std::vector<double> stamps;
  std::vector<Eigen::Vector2d> curve;
  for (const AtePair& pair : run.evaluation->ate.pairs) {
    stamps.push_back(pair.timestamp);
    curve.push_back(area.pixel({pair.timestamp - start, logarithm(pair.error)}));
  }
  for (const auto& [first, end] : continuous_ranges(stamps))
    svg.polyline(std::span(curve).subspan(first, end - first), "curve",
                 std::string("stroke:") + color);
}

void draw_curves(Svg& svg, const ChartArea& area, const Comparison& comparison) {
  draw_x_axis(svg, area, static_cast<int>(area.width / 90) + 1, "time [s]");
  draw_logarithmic_y_axis(svg, area, "absolute error [m]");
  svg.begin_clip(area.left, area.top, area.width, area.height);
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const ComparedRun& run = comparison.runs[i];
    if (!run.evaluation) continue;
    draw_curve(svg, area, run, evaluated_time(comparison, run.sequence).low, color_of(i));
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
  return html_card(
      "Errors", html,
      "Rigid alignment without scale. Gain: reduction of the value to its left relative to the "
      "first run, or the ratio of both if the value is more than twice as large. Frames: tracked "
      "and all.");
}

std::string findings_section(const Comparison& comparison) {
  std::string html;
  for (const Finding& finding : findings_of(comparison))
    html += "<p class=\"untrusted\"><b>Do not trust this result:</b> " +
            escape_markup(finding.text()) + "</p>\n";
  return html;
}

/// Returns the paths of each run in a panel of its own, as many beside each other as fit.
std::string paths_card(const Comparison& comparison) {
  std::string panels;
  for (const ComparedRun& run : comparison.runs)
    panels += "<figure>" + run_paths_chart(run).element() + "</figure>\n";
  return html_card("Paths from above",
                   "<div class=\"gallery\">\n" + panels +
                       "</div>\n<div class=\"legend\">"
                       "<span><i style=\"color:var(--truth)\"></i>ground truth</span>"
                       "<span><i style=\"color:var(--accent)\"></i>estimate, aligned</span>"
                       "<span><i style=\"color:var(--bad)\"></i>error</span></div>\n");
}

/// Returns the chart of errors twice, of which the style sheet shows the one for the page's width.
std::string errors_card(const Comparison& comparison) {
  return html_card("Distribution of the error, and error over time",
                   "<div class=\"on-wide\">" + error_distribution_chart(comparison).element() +
                       "</div>\n<div class=\"on-narrow\">" +
                       error_distribution_chart(comparison, kNarrow).element() + "</div>\n",
                   "Box: quartiles and median; whiskers: 5 % and 95 % quantiles. The colors are "
                   "the same in both charts. Time begins with the first evaluated pose of any "
                   "run.");
}

std::string maps_card(const std::vector<CaptionedImage>& maps) {
  std::string figures;
  for (const CaptionedImage& map : maps) figures += html_figure(map);
  return html_card("Static maps",
                   figures.empty() ? "" : "<div class=\"gallery\">\n" + figures + "</div>\n");
}

Layout layout_of(const Comparison& comparison, double width) {
  constexpr double kTop = 8, kAxis = 64, kCurves = 260, kRight = 16, kLeft = 80;  // pixels
  std::size_t longest = 8;
  for (const ComparedRun& run : comparison.runs)
    longest = std::max(longest, std::min(kNameLength, name_of(run).size()));
  const ValueRange errors = error_range(comparison);
  Layout layout;
  const double names = 14 + kCharacter * static_cast<double>(longest);
  layout.names_above = names > width / 3;
  if (layout.names_above) layout.row = 48;
  const double height = layout.row * static_cast<double>(comparison.runs.size());
  const double left = layout.names_above ? kRight : names;
  layout.boxes = {left, kTop, width - left - kRight, height, errors, {0, 1}};
  layout.curves = {kLeft,   kTop + height + kAxis,        width - kLeft - kRight,
                   kCurves, {0, duration_of(comparison)}, errors};
  return layout;
}

}  // namespace

Svg error_distribution_chart(const Comparison& comparison, double width) {
  const Layout layout = layout_of(comparison, width);
  Svg svg(width, layout.curves.bottom() + 52, "absolute error of each run, and over time");
  draw_boxes(svg, layout, comparison);
  draw_curves(svg, layout.curves, comparison);
  return svg;
}

std::string comparison_page(const Comparison& comparison, const std::vector<std::string>& files,
                            const std::vector<CaptionedImage>& maps) {
  std::string links;
  for (const std::string& file : files)
    links += fmt::format("<a class=\"chip\" href=\"{0}\">{0}</a>\n", escape_markup(file));
  const std::string body =
      fmt::format(
          "<header><h1>Comparison of {} runs</h1>\n<div class=\"chips\">\n{}</div></header>\n",
          comparison.runs.size(), links) +
      findings_section(comparison) + tables_card(comparison) + errors_card(comparison) +
      paths_card(comparison) + maps_card(maps);
  return html_page("Stillmap: comparison", body,
                   "Made by Stillmap. Error figures cover tracked frames only: compare them "
                   "together with the coverage.");
}

}  // namespace stillmap
