// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/report_charts.hpp"

#include "stillmap/evaluate/chart_axes.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/evaluate/svg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kPageWidth = 1000;  // view box of charts as wide as the page
constexpr double kTimeLeft = 84;     // margins of the charts over time, one below the other
constexpr double kTimeRight = 16;
constexpr double kPanelWidth = 490;  // of the two beside each other
constexpr double kPanelHeight = 430;
constexpr int kColors = 16;      // steps of the error scale
constexpr double kMatch = 1e-4;  // stamps this near are of the same frame [s]

/// Blue, teal, amber, red: legible on white and on black, and in order of lightness and warmth.
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

/// The scale ends at the 99th percentile, so that one outlier does not turn all else blue.
double highest_shown_error(const Evaluation& evaluation) {
  std::vector<double> errors;
  for (const AtePair& pair : evaluation.ate.pairs) errors.push_back(pair.error);
  return quantile(errors, 0.99);
}

double median_interval(const Trajectory& trajectory) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    intervals.push_back(trajectory[i].timestamp - trajectory[i - 1].timestamp);
  }
  return quantile(intervals, 0.5);
}

/// A position on the path that is drawn.
struct PathPoint {
  double timestamp = 0;
  Eigen::Vector3d p;
  double error = 0;
};

/// The estimate: in the truth's world with errors where it was evaluated, else as it is.
std::vector<PathPoint> path_of(const ReportData& data) {
  std::vector<PathPoint> path;
  if (data.evaluation) {
    for (const AtePair& pair : data.evaluation->ate.pairs) {
      path.push_back({pair.timestamp, pair.p_estimate, pair.error});
    }
  } else {
    for (const auto& [stamp, T] : data.trajectory) path.push_back({stamp, T.translation(), 0});
  }
  return path;
}

std::vector<Eigen::Vector3d> true_path_of(const ReportData& data) {
  std::vector<Eigen::Vector3d> path;
  if (!data.truth || !data.evaluation) return path;
  for (const auto& [stamp, T] : *data.truth) path.push_back(T.translation());
  return path;
}

PaperPlane plane_of(const ReportData& data, bool from_above, const std::vector<PathPoint>& path) {
  const bool in_truths_world = data.truth && data.evaluation;
  const Eigen::Vector3d up = up_axis(in_truths_world ? *data.truth : data.trajectory);
  if (from_above) return plane_from_above(up);
  std::vector<Eigen::Vector3d> points = true_path_of(data);
  for (const PathPoint& point : path) points.push_back(point.p);
  return plane_from_the_side(up, points);
}

/// A rectangle of the drawing that shows a rectangle of values.
struct Frame {
  double left = 0, top = 0, width = 1, height = 1;
  Range x, y;
  double px(double value) const { return left + (value - x.low) / x.size() * width; }
  double py(double value) const { return top + (y.high - value) / y.size() * height; }
  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

/// Grows one range so that a unit is equally long along both axes.
void equalize(Frame& frame) {
  const double scale = std::min(frame.width / frame.x.size(), frame.height / frame.y.size());
  frame.x = frame.x.grown((frame.width / scale - frame.x.size()) / 2);
  frame.y = frame.y.grown((frame.height / scale - frame.y.size()) / 2);
}

void draw_x_ticks(Svg& svg, const Frame& frame, int count, const std::string& title) {
  const std::vector<double> ticks = nice_ticks(frame.x, count);
  const std::vector<std::string> labels = tick_labels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double x = frame.px(ticks[i]);
    svg.line(x, frame.top, x, frame.bottom(), "grid");
    svg.text(x, frame.bottom() + 18, labels[i], "middle", "tick");
  }
  svg.text(frame.left + frame.width / 2, frame.bottom() + 38, title, "middle");
}

void draw_y_ticks(Svg& svg, const Frame& frame, int count, const std::string& title,
                  bool reversed = false) {
  const std::vector<double> ticks = nice_ticks(frame.y, count);
  const std::vector<std::string> labels = tick_labels(ticks, reversed);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double y = frame.py(ticks[i]);
    svg.line(frame.left, y, frame.right(), y, "grid");
    svg.text(frame.left - 8, y + 4, labels[i], "end", "tick");
  }
  svg.text_upwards(frame.left - 46, frame.top + frame.height / 2, title);
}

Frame trajectory_frame(const PaperPlane& plane, const std::vector<PathPoint>& path,
                       const std::vector<Eigen::Vector3d>& truth) {
  Frame frame{60, 12, kPanelWidth - 60 - 14, kPanelHeight - 12 - 48, {}, {}};
  const auto include = [&](const Eigen::Vector3d& p) {
    frame.x.include(plane(p).x());
    frame.y.include(plane(p).y());
  };
  for (const PathPoint& point : path) include(point.p);
  for (const Eigen::Vector3d& p : truth) include(p);
  const double margin = 0.06 * std::max({frame.x.size(), frame.y.size(), 0.02});
  frame.x = frame.x.grown(margin);
  frame.y = frame.y.grown(margin);
  equalize(frame);
  return frame;
}

/// Splits a path where tracking was lost or the color changes, and draws each part.
void draw_path(Svg& svg, const std::vector<PathPoint>& path,
               const std::vector<Eigen::Vector2d>& pixels, double longest_interval,
               const std::function<int(const PathPoint&)>& color) {
  std::vector<Eigen::Vector2d> part;
  const auto flush = [&](int step) {
    svg.polyline(part, "estimate", step < 0 ? "" : "stroke:" + color_of_step(step));
    part.clear();
  };
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool lost = i > 0 && path[i].timestamp - path[i - 1].timestamp > longest_interval;
    if (lost) flush(color(path[i - 1]));
    part.push_back(pixels[i]);
    if (i > 0 && !lost && color(path[i]) != color(path[i - 1])) {
      flush(color(path[i - 1]));
      part.push_back(pixels[i]);
    }
  }
  if (!path.empty()) flush(color(path.back()));
}

void draw_ends(Svg& svg, const std::vector<Eigen::Vector2d>& pixels) {
  if (pixels.empty()) return;
  svg.circle(pixels.front().x(), pixels.front().y(), 4.5, "start", "start");
  svg.rectangle(pixels.back().x() - 4, pixels.back().y() - 4, 8, 8, "end", "end");
}

/// Times are shown from the first frame on.
double start_of(const ReportData& data) {
  if (!data.frame_stamps.empty()) return data.frame_stamps.front();
  return data.trajectory.empty() ? 0 : data.trajectory.front().timestamp;
}

double end_of(const ReportData& data) {
  double end = start_of(data);
  if (!data.frame_stamps.empty()) end = std::max(end, data.frame_stamps.back());
  if (!data.trajectory.empty()) end = std::max(end, data.trajectory.back().timestamp);
  return end;
}

void draw_events(Svg& svg, const ReportData& data, const Frame& frame) {
  for (const ReportEvent& event : data.events) {
    const double x = frame.px(event.timestamp - start_of(data));
    svg.line(x, frame.top, x, frame.bottom(), "event");
    // Wider than the line, and invisible: something for the pointer to rest on.
    svg.rectangle(x - 4, frame.top, 8, frame.height, "hover",
                  fmt::format("{:.2f} s: {}", event.timestamp - start_of(data), event.text));
  }
}

void draw_error_curve(Svg& svg, const ReportData& data, const Frame& frame) {
  const std::vector<AtePair>& pairs = data.evaluation->ate.pairs;
  const double longest = 3.5 * median_interval(data.trajectory);
  std::vector<Eigen::Vector2d> part;
  const auto flush = [&] {
    if (part.empty()) return;
    std::vector<Eigen::Vector2d> area = part;
    area.emplace_back(part.back().x(), frame.bottom());
    area.emplace_back(part.front().x(), frame.bottom());
    svg.polygon(area, "area");
    svg.polyline(part, "curve");
    part.clear();
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0 && pairs[i].timestamp - pairs[i - 1].timestamp > longest) flush();
    part.emplace_back(frame.px(pairs[i].timestamp - start_of(data)),
                      frame.py(1000 * pairs[i].error));
  }
  flush();
}

/// For each frame, whether it was tracked.
std::vector<bool> tracked_flags(const ReportData& data) {
  std::vector<bool> tracked;
  std::size_t next = 0;
  for (const double stamp : data.frame_stamps) {
    while (next < data.trajectory.size() && data.trajectory[next].timestamp < stamp - kMatch)
      ++next;
    tracked.push_back(next < data.trajectory.size() &&
                      data.trajectory[next].timestamp <= stamp + kMatch);
  }
  return tracked;
}

void draw_tracked(Svg& svg, const ReportData& data, const Frame& frame) {
  const std::vector<bool> tracked = tracked_flags(data);
  const std::vector<double>& stamps = data.frame_stamps;
  for (std::size_t first = 0; first < stamps.size();) {
    std::size_t last = first;
    while (last + 1 < stamps.size() && tracked[last + 1] == tracked[first]) ++last;
    const double from = stamps[first] - stamps.front();
    const double to = stamps[std::min(last + 1, stamps.size() - 1)] - stamps.front();
    const double x = frame.px(from);
    svg.rectangle(x, frame.top, std::max(1.5, frame.px(to) - x), frame.height,
                  tracked[first] ? "tracked" : "lost",
                  fmt::format("{}: {} frames, {:.2f} to {:.2f} s",
                              tracked[first] ? "tracked" : "lost", last - first + 1, from, to));
    first = last + 1;
  }
}

}  // namespace

std::string trajectory_chart(const ReportData& data, bool from_above) {
  const std::vector<PathPoint> path = path_of(data);
  if (path.empty()) return "";
  const std::vector<Eigen::Vector3d> truth = true_path_of(data);
  const PaperPlane plane = plane_of(data, from_above, path);
  const Frame frame = trajectory_frame(plane, path, truth);
  const auto pixel = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector2d(frame.px(plane(p).x()), frame.py(plane(p).y()));
  };
  std::vector<Eigen::Vector2d> pixels, true_pixels;
  for (const PathPoint& point : path) pixels.push_back(pixel(point.p));
  for (const Eigen::Vector3d& p : truth) true_pixels.push_back(pixel(p));

  Svg svg(kPanelWidth, kPanelHeight, from_above ? "path from above" : "path from the side");
  draw_x_ticks(svg, frame, 6, plane.right.label());
  draw_y_ticks(svg, frame, 6, plane.up.label(), plane.up.reversed);
  svg.begin_clip(frame.left, frame.top, frame.width, frame.height);
  svg.polyline(true_pixels, "truth");
  const double highest = data.evaluation ? highest_shown_error(*data.evaluation) : 0;
  draw_path(svg, path, pixels, 3.5 * median_interval(data.trajectory), [&](const PathPoint& p) {
    return data.evaluation ? color_step(p.error, highest) : -1;
  });
  draw_ends(svg, pixels);
  svg.end_clip();
  svg.rectangle(frame.left, frame.top, frame.width, frame.height, "frame");
  return svg.finished();
}

std::string error_color_bar(const ReportData& data) {
  if (!data.evaluation) return "";
  const double highest = highest_shown_error(*data.evaluation);
  constexpr double kWidth = 320, kLeft = 10;
  Svg svg(kWidth + 2 * kLeft, 34, "colors of the error");
  for (int i = 0; i < kColors; ++i) {
    svg.rectangle(kLeft + i * kWidth / kColors, 2, kWidth / kColors + 0.5, 10, "plain", "",
                  "fill:" + color_of_step(i));
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    svg.text(kLeft + share * kWidth, 28, fmt::format("{:.1f}", 1000 * share * highest),
             share == 0   ? "start"
             : share == 1 ? "end"
                          : "middle",
             "tick");
  }
  return svg.finished();
}

std::string error_chart(const ReportData& data) {
  if (!data.evaluation || data.evaluation->ate.pairs.empty()) return "";
  Frame frame{
      kTimeLeft, 12, kPageWidth - kTimeLeft - kTimeRight, 190, {0, end_of(data) - start_of(data)},
      {0, 0}};
  frame.x.high = std::max(frame.x.high, 1e-3);
  const Statistics& errors = data.evaluation->ate.translation;
  frame.y.high = std::max(1e-3, 1.08 * 1000 * errors.max);
  Svg svg(kPageWidth, 252, "absolute error over time");
  draw_x_ticks(svg, frame, 10, "time [s]");
  draw_y_ticks(svg, frame, 4, "error [mm]");
  draw_error_curve(svg, data, frame);
  const double y = frame.py(1000 * errors.rmse);
  svg.line(frame.left, y, frame.right(), y, "reference");
  svg.text(frame.right() - 6, y - 6, fmt::format("RMSE {:.1f} mm", 1000 * errors.rmse), "end",
           "reference-label");
  draw_events(svg, data, frame);
  svg.rectangle(frame.left, frame.top, frame.width, frame.height, "frame");
  return svg.finished();
}

std::string coverage_strip(const ReportData& data) {
  if (data.frame_stamps.size() < 2) return "";
  Frame frame{
      kTimeLeft, 4, kPageWidth - kTimeLeft - kTimeRight, 26, {0, end_of(data) - start_of(data)},
      {0, 1}};
  if (!(frame.x.high > 0)) return "";
  Svg svg(kPageWidth, 88, "tracked and lost frames over time");
  draw_tracked(svg, data, frame);
  svg.text(frame.left - 8, frame.top + 17, "frames", "end", "tick");
  for (const double stamp : data.keyframe_stamps) {
    const double x = frame.px(stamp - start_of(data));
    svg.line(x, frame.bottom() + 4, x, frame.bottom() + 14, "keyframe");
  }
  if (!data.keyframe_stamps.empty()) {
    svg.text(frame.left - 8, frame.bottom() + 13, "keyframes", "end", "tick");
  }
  Frame both_rows = frame;
  both_rows.height += 14;
  draw_events(svg, data, both_rows);
  Frame axis = frame;
  axis.top = frame.bottom() + 18;
  axis.height = 0;
  draw_x_ticks(svg, axis, 10, "time [s]");
  return svg.finished();
}

std::string timing_chart(const ReportData& data) {
  if (data.timing.empty()) return "";
  constexpr double kLeft = 190, kRow = 30, kWidth = kPageWidth - kLeft - 150;
  double longest = 1e-6;
  for (const StageTiming& stage : data.timing) longest = std::max(longest, stage.p95);
  const double height = kRow * static_cast<double>(data.timing.size());
  Frame frame{kLeft, 4, kWidth, height, {0, 1.02 * longest}, {0, 1}};
  Svg svg(kPageWidth, height + 52, "milliseconds per stage");
  draw_x_ticks(svg, frame, 8, "milliseconds per call");
  double y = frame.top + kRow / 2;
  for (const StageTiming& stage : data.timing) {
    const std::string hint = fmt::format(
        "{}: {} calls, median {:.2f}, mean {:.2f}, p95 {:.2f}, p99 {:.2f}, max {:.2f} ms",
        stage.name, stage.count, stage.median, stage.mean, stage.p95, stage.p99, stage.max);
    svg.text(kLeft - 10, y + 4, stage.name, "end");
    svg.rectangle(kLeft, y - 9, frame.px(stage.p95) - kLeft, 18, "bar-p95", hint);
    svg.rectangle(kLeft, y - 9, frame.px(stage.median) - kLeft, 18, "bar", hint);
    svg.text(frame.right() + 10, y + 4, fmt::format("{:.2f} / {:.2f} ms", stage.median, stage.p95),
             "start", "tick");
    y += kRow;
  }
  return svg.finished();
}

}  // namespace stillmap
