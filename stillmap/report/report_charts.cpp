// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/report_charts.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/report/chart.hpp"
#include "stillmap/report/svg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kPageWidth = 1000;  // view box of charts as wide as the page
constexpr double kTimeLeft = 84;     // margins of the charts over time, which are aligned
constexpr double kTimeRight = 16;
constexpr double kPanelWidth = 490;  // of the two trajectory charts
constexpr double kPanelHeight = 430;
constexpr int kColors = 16;             // steps of the error scale
constexpr double kShortestTime = 0.01;  // start of the logarithmic time axis [ms]
constexpr double kMatch = 1e-4;         // maximum difference of time stamps of one frame [s]

/// Returns a color of the scale from blue over teal and amber to red, legible on white and on
/// black.
std::string error_color(double share) {
  constexpr std::array<std::array<double, 3>, 4> kStops{
      {{46, 116, 196}, {54, 172, 150}, {238, 178, 52}, {216, 52, 52}}};
  const double position = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(position), kStops.size() - 2);
  std::array<int, 3> rgb{};
  for (std::size_t i = 0; i < 3; ++i) {
    rgb[i] = static_cast<int>(std::lround(
        std::lerp(kStops[below][i], kStops[below + 1][i], position - static_cast<double>(below))));
  }
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

int color_step(double error, double highest) {
  if (!(highest > 0)) return 0;
  return std::clamp(static_cast<int>(error / highest * kColors), 0, kColors - 1);
}

std::string color_of_step(int step) { return error_color((step + 0.5) / kColors); }

/// Returns the end of the error scale [m]: the 99th percentile, so that an outlier does not make
/// all other errors blue.
double highest_shown_error(const Evaluation& evaluation) {
  std::vector<double> errors;
  for (const AtePair& pair : evaluation.ate.pairs) errors.push_back(pair.error);
  return quantile(errors, 0.99);
}

/// A position of the camera; `error` is its distance from the truth [m].
struct PathPoint {
  double timestamp = 0;
  Eigen::Vector3d p;
  double error = 0;
};

/// Returns the estimated path, aligned to the truth and with errors if there is an evaluation.
std::vector<PathPoint> path_of(const RunRecord& record) {
  std::vector<PathPoint> path;
  if (record.evaluation) {
    for (const AtePair& pair : record.evaluation->ate.pairs) {
      path.push_back({pair.timestamp, pair.p_estimate, pair.error});
    }
  } else {
    for (const auto& [stamp, T] : record.result.trajectory)
      path.push_back({stamp, T.translation(), 0});
  }
  return path;
}

/// Returns time zero of the charts: the timestamp of the first frame [s].
double start_of(const RunRecord& record) {
  if (!record.result.frames.empty()) return record.result.frames.front().timestamp;
  return record.result.trajectory.empty() ? 0 : record.result.trajectory.front().timestamp;
}

/// Returns the length of the time axis [s].
double duration_of(const RunRecord& record) {
  const SlamResult& result = record.result;
  double end = start_of(record);
  if (!result.frames.empty()) end = std::max(end, result.frames.back().timestamp);
  if (!result.trajectory.empty()) end = std::max(end, result.trajectory.back().timestamp);
  for (const double late : record.late_frames()) end = std::max(end, late);
  return end - start_of(record);
}

/// Returns the true path during the run.
std::vector<Eigen::Vector3d> true_path_of(const RunRecord& record) {
  std::vector<Eigen::Vector3d> path;
  if (!record.truth || !record.evaluation) return path;
  const double begin = start_of(record), end = begin + duration_of(record);
  for (const auto& [stamp, T] : *record.truth) {
    if (stamp >= begin - kMatch && stamp <= end + kMatch) path.push_back(T.translation());
  }
  return path;
}

ProjectionPlane plane_of(const RunRecord& record, PathView view,
                         const std::vector<PathPoint>& path) {
  const bool in_truths_world = record.truth && record.evaluation;
  const Eigen::Vector3d up = up_axis(in_truths_world ? *record.truth : record.result.trajectory);
  if (view == PathView::kFromAbove) return plane_from_above(up);
  std::vector<Eigen::Vector3d> points = true_path_of(record);
  for (const PathPoint& point : path) points.push_back(point.p);
  return plane_from_the_side(up, points);
}

ChartArea trajectory_area(const ProjectionPlane& plane, const std::vector<PathPoint>& path,
                          const std::vector<Eigen::Vector3d>& truth) {
  ChartArea area{60, 12, kPanelWidth - 60 - 14, kPanelHeight - 12 - 48, {}, {}};
  const auto include = [&](const Eigen::Vector3d& p) {
    area.x.include(plane(p).x());
    area.y.include(plane(p).y());
  };
  for (const PathPoint& point : path) include(point.p);
  for (const Eigen::Vector3d& p : truth) include(p);
  area.fit_equal_scale();
  return area;
}

template <typename Poses>
std::vector<double> stamps_of(const Poses& poses) {
  std::vector<double> stamps;
  for (const auto& pose : poses) stamps.push_back(pose.timestamp);
  return stamps;
}

/// Draws the path in parts of one color; it is interrupted where tracking was lost.
void draw_path(Svg& svg, const std::vector<PathPoint>& path,
               const std::vector<Eigen::Vector2d>& pixels,
               const std::function<int(const PathPoint&)>& color) {
  const std::span all(pixels);
  for (const auto& [first, end] : continuous_ranges(stamps_of(path))) {
    for (std::size_t from = first; from < end;) {
      std::size_t to = from + 1;
      while (to < end && color(path[to]) == color(path[from])) ++to;
      const int step = color(path[from]);
      svg.polyline(all.subspan(from, std::min(to + 1, end) - from), "estimate",
                   step < 0 ? "" : "stroke:" + color_of_step(step));
      from = to;
    }
  }
}

void draw_ends(Svg& svg, const std::vector<Eigen::Vector2d>& pixels) {
  if (pixels.empty()) return;
  svg.circle(pixels.front(), 4.5, "start", "start");
  svg.rectangle(pixels.back().x() - 4, pixels.back().y() - 4, 8, 8, "end", "end");
}

void draw_events(Svg& svg, const RunRecord& record, const ChartArea& area) {
  for (const RunEvent& event : run_events(record.result)) {
    const double x = area.px(event.timestamp - start_of(record));
    svg.line({x, area.top}, {x, area.bottom()}, "event");
    // An invisible rectangle, wider than the line, shows the tooltip.
    svg.rectangle(x - 4, area.top, 8, area.height, "hover",
                  fmt::format("{:.2f} s: {}", event.timestamp - start_of(record), event.text));
  }
}

void draw_error_curve(Svg& svg, const RunRecord& record, const ChartArea& area) {
  const std::vector<AtePair>& pairs = record.evaluation->ate.pairs;
  for (const auto& [first, end] : continuous_ranges(stamps_of(pairs))) {
    std::vector<Eigen::Vector2d> curve;
    for (std::size_t i = first; i < end; ++i)
      curve.push_back(area.pixel({pairs[i].timestamp - start_of(record), 1000 * pairs[i].error}));
    std::vector<Eigen::Vector2d> below = curve;
    below.emplace_back(curve.back().x(), area.bottom());
    below.emplace_back(curve.front().x(), area.bottom());
    svg.polygon(below, "area");
    svg.polyline(curve, "curve");
  }
}

/// A frame of the coverage strip.
struct CoveredFrame {
  double timestamp = 0;      // [s]
  std::string_view outcome;  // "tracked", "lost" or "dropped", also the class in the style sheet
};

/// Returns all frames from the first processed one on; tracked ones have a pose in the final
/// trajectory.
std::vector<CoveredFrame> covered_frames(const RunRecord& record) {
  std::vector<CoveredFrame> frames;
  const Trajectory& trajectory = record.result.trajectory;
  auto next = trajectory.begin();
  for (const FrameRecord& frame : record.result.frames) {
    while (next != trajectory.end() && next->timestamp < frame.timestamp - kMatch) ++next;
    const bool tracked = next != trajectory.end() && next->timestamp <= frame.timestamp + kMatch;
    frames.push_back({frame.timestamp, tracked ? "tracked" : "lost"});
  }
  for (const double late : record.late_frames()) {
    if (late >= start_of(record)) frames.push_back({late, "dropped"});
  }
  std::stable_sort(frames.begin(), frames.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return frames;
}

void draw_coverage(Svg& svg, const RunRecord& record, const ChartArea& area) {
  const std::vector<CoveredFrame> frames = covered_frames(record);
  const double start = frames.front().timestamp;
  for (std::size_t first = 0; first < frames.size();) {
    std::size_t last = first;
    while (last + 1 < frames.size() && frames[last + 1].outcome == frames[first].outcome) ++last;
    const double from = frames[first].timestamp - start;
    const double to = frames[std::min(last + 1, frames.size() - 1)].timestamp - start;
    const double x = area.px(from);
    svg.rectangle(x, area.top, std::max(1.5, area.px(to) - x), area.height, frames[first].outcome,
                  fmt::format("{}: {}, {:.2f} to {:.2f} s", frames[first].outcome,
                              counted(last - first + 1, "frame"), from, to));
    first = last + 1;
  }
}

/// Draws the periods in which the dynamics gate judged the scene highly dynamic.
void draw_dynamics(Svg& svg, const RunRecord& record, const ChartArea& area) {
  for (const DynamicsPeriod& period : dynamics_periods(record.result)) {
    const double from = period.begin - start_of(record), to = period.end - start_of(record);
    const bool high = period.dynamics == Dynamics::kHigh;
    svg.rectangle(area.px(from), area.top, std::max(1.5, area.px(to) - area.px(from)), area.height,
                  high ? "dynamic" : "hover",
                  fmt::format("{} dynamics, {:.2f} to {:.2f} s", high ? "high" : "low", from, to));
  }
}

}  // namespace

std::string trajectory_chart(const RunRecord& record, PathView view) {
  const std::vector<PathPoint> path = path_of(record);
  if (path.empty()) return "";
  const std::vector<Eigen::Vector3d> truth = true_path_of(record);
  const ProjectionPlane plane = plane_of(record, view, path);
  const ChartArea area = trajectory_area(plane, path, truth);
  const auto pixel = [&](const Eigen::Vector3d& p) { return area.pixel(plane(p)); };
  std::vector<Eigen::Vector2d> pixels, true_pixels;
  for (const PathPoint& point : path) pixels.push_back(pixel(point.p));
  for (const Eigen::Vector3d& p : truth) true_pixels.push_back(pixel(p));

  Svg svg(kPanelWidth, kPanelHeight,
          view == PathView::kFromAbove ? "path from above" : "path from the side");
  draw_axes(svg, area, plane);
  svg.begin_clip(area.left, area.top, area.width, area.height);
  svg.polyline(true_pixels, "truth");
  const double highest = record.evaluation ? highest_shown_error(*record.evaluation) : 0;
  draw_path(svg, path, pixels, [&](const PathPoint& p) {
    return record.evaluation ? color_step(p.error, highest) : -1;
  });
  draw_ends(svg, pixels);
  svg.end_clip();
  svg.rectangle(area.left, area.top, area.width, area.height, "frame");
  return svg.element();
}

std::string error_color_bar(const RunRecord& record) {
  if (!record.evaluation) return "";
  const double highest = highest_shown_error(*record.evaluation);
  constexpr double kWidth = 320, kLeft = 10;
  Svg svg(kWidth + 2 * kLeft, 34, "colors of the error");
  for (int i = 0; i < kColors; ++i) {
    svg.rectangle(kLeft + i * kWidth / kColors, 2, kWidth / kColors + 0.5, 10, "plain", "",
                  "fill:" + color_of_step(i));
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    svg.text({kLeft + share * kWidth, 28}, fmt::format("{:.1f}", 1000 * share * highest),
             share == 0   ? "start"
             : share == 1 ? "end"
                          : "middle",
             "tick");
  }
  return svg.element();
}

std::string error_chart(const RunRecord& record) {
  if (!record.evaluation || record.evaluation->ate.pairs.empty()) return "";
  ChartArea area{kTimeLeft, 12, kPageWidth - kTimeLeft - kTimeRight, 190, {0, duration_of(record)},
                 {0, 0}};
  area.x.high = std::max(area.x.high, 1e-3);
  const Statistics& errors = record.evaluation->ate.translation;
  area.y.high = std::max(1e-3, 1.08 * 1000 * errors.max);
  Svg svg(kPageWidth, 252, "absolute error over time");
  draw_x_axis(svg, area, 10, "time [s]");
  draw_y_axis(svg, area, 4, "error [mm]");
  draw_error_curve(svg, record, area);
  const double y = area.py(1000 * errors.rmse);
  svg.line({area.left, y}, {area.right(), y}, "reference");
  svg.text({area.right() - 6, y - 6}, fmt::format("RMSE {:.1f} mm", 1000 * errors.rmse), "end",
           "reference-label");
  draw_events(svg, record, area);
  svg.rectangle(area.left, area.top, area.width, area.height, "frame");
  return svg.element();
}

std::string coverage_strip(const RunRecord& record) {
  if (record.result.frames.size() < 2) return "";
  ChartArea area{kTimeLeft, 4, kPageWidth - kTimeLeft - kTimeRight, 26, {0, duration_of(record)},
                 {0, 1}};
  if (!(area.x.high > 0)) return "";
  const bool has_gate = !dynamics_periods(record.result).empty();
  constexpr double kGateRow = 18;
  Svg svg(kPageWidth, has_gate ? 88 + kGateRow : 88, "tracked, lost and dropped frames over time");
  draw_coverage(svg, record, area);
  svg.text({area.left - 8, area.top + 17}, "frames", "end", "tick");
  for (const auto& [stamp, pose] : record.result.keyframes) {
    const double x = area.px(stamp - start_of(record));
    svg.line({x, area.bottom() + 4}, {x, area.bottom() + 14}, "keyframe");
  }
  if (!record.result.keyframes.empty()) {
    svg.text({area.left - 8, area.bottom() + 13}, "keyframes", "end", "tick");
  }
  ChartArea all_rows = area;
  all_rows.height += 14;
  if (has_gate) {
    ChartArea gate = area;
    gate.top = area.bottom() + kGateRow;
    gate.height = 10;
    draw_dynamics(svg, record, gate);
    svg.text({area.left - 8, gate.top + 9}, "dynamic", "end", "tick");
    all_rows.height += kGateRow;
  }
  draw_events(svg, record, all_rows);
  ChartArea axis = area;
  axis.top = all_rows.bottom() + 4;
  axis.height = 0;
  draw_x_axis(svg, axis, 10, "time [s]");
  return svg.element();
}

std::string timing_chart(const RunRecord& record) {
  const std::vector<StageTiming> stages = record.result.timing.stages();
  if (stages.empty()) return "";
  constexpr double kRow = 30, kNumbers = 150, kCharacter = 7.4;  // pixels
  std::size_t longest_name = 0;
  double longest = kShortestTime;
  for (const StageTiming& stage : stages) {
    longest_name = std::max(longest_name, stage.name.size());
    longest = std::max(longest, stage.p95);
  }
  const double left = 14 + kCharacter * static_cast<double>(longest_name);
  const double height = kRow * static_cast<double>(stages.size());
  const ChartArea area{left,
                       4,
                       kPageWidth - left - kNumbers,
                       height,
                       {std::log10(kShortestTime), std::log10(1.02 * longest)},
                       {0, 1}};
  Svg svg(kPageWidth, height + 52, "milliseconds per stage");
  draw_logarithmic_x_axis(svg, area, "milliseconds per call");
  const auto width = [&](double time) {
    return area.px(std::log10(std::max(time, kShortestTime))) - left;
  };
  double y = area.top + kRow / 2;
  for (const StageTiming& stage : stages) {
    const std::string hint = fmt::format(
        "{}: {} calls, median {:.2f}, mean {:.2f}, p95 {:.2f}, p99 {:.2f}, max {:.2f} ms",
        stage.name, stage.count, stage.median, stage.mean, stage.p95, stage.p99, stage.max);
    svg.text({left - 10, y + 4}, stage.name, "end");
    svg.rectangle(left, y - 9, width(stage.p95), 18, "bar-p95", hint);
    svg.rectangle(left, y - 9, width(stage.median), 18, "bar", hint);
    svg.text({area.right() + 10, y + 4}, fmt::format("{:.2f} / {:.2f} ms", stage.median, stage.p95),
             "start", "tick");
    y += kRow;
  }
  return svg.element();
}

}  // namespace stillmap
