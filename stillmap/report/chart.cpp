// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/chart.hpp"

#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/geometry/mean_up.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns the smallest of 1, 2, 5, 10 times a power of ten that is not below `step`.
double round_up_to_nice(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (step <= factor * power * (1 + 1e-9)) return factor * power;
  }
  return 10 * power;
}

/// A grid line of an axis; without a label if that is empty.
struct LabeledTick {
  double value = 0;
  std::string label;
};

std::vector<LabeledTick> nice_labeled_ticks(const ValueRange& range, int count, bool reversed) {
  const std::vector<double> values = nice_ticks(range, count);
  const std::vector<std::string> labels = tick_labels(values, reversed);
  std::vector<LabeledTick> ticks;
  for (std::size_t i = 0; i < values.size(); ++i) ticks.push_back({values[i], labels[i]});
  return ticks;
}

std::vector<LabeledTick> logarithmic_ticks(const ValueRange& range) {
  constexpr double kShort = 2.5;  // decades up to which all grid lines are labeled
  std::vector<LabeledTick> ticks;
  const auto first = static_cast<int>(std::floor(range.low));
  // Powers of ten come first, so that their labels are the ones that remain in narrow charts.
  for (const int factor : {1, 2, 5}) {
    for (int decade = first; decade <= range.high; ++decade) {
      const double value = factor * std::pow(10.0, decade), logarithm = std::log10(value);
      if (logarithm < range.low - 1e-9 || logarithm > range.high + 1e-9) continue;
      const bool labeled = factor == 1 || range.size() < kShort;
      ticks.push_back({logarithm, labeled ? fmt::format("{:g}", value) : ""});
    }
  }
  return ticks;
}

/// Returns the width of a label of class "tick" in a wide font (DejaVu Sans) [pixels].
double width_of(const std::string& label) {
  double width = 0;
  for (const char c : label) width += c == '.' || c == '-' ? 4.5 : 8.0;
  return width;
}

void draw_x_ticks(Svg& svg, const ChartArea& area, const std::vector<LabeledTick>& ticks,
                  std::string_view title) {
  constexpr double kGap = 6;  // least distance of two labels [pixels]
  std::vector<ValueRange> used;
  for (const auto& [value, label] : ticks) {
    const double x = area.px(value);
    svg.line({x, area.top}, {x, area.bottom()}, "grid");
    const ValueRange extent = ValueRange{x, x}.grown((width_of(label) + kGap) / 2);
    const bool is_free = std::none_of(used.begin(), used.end(), [&](const ValueRange& other) {
      return extent.low < other.high && other.low < extent.high;
    });
    if (label.empty() || !is_free) continue;
    svg.text({x, area.bottom() + 18}, label, "middle", "tick");
    used.push_back(extent);
  }
  svg.text({area.left + area.width / 2, area.bottom() + 38}, title, "middle");
}

void draw_y_ticks(Svg& svg, const ChartArea& area, const std::vector<LabeledTick>& ticks,
                  std::string_view title) {
  double widest = 0;
  for (const auto& [value, label] : ticks) {
    const double y = area.py(value);
    svg.line({area.left, y}, {area.right(), y}, "grid");
    if (!label.empty()) svg.text({area.left - 8, y + 4}, label, "end", "tick");
    widest = std::max(widest, width_of(label));
  }
  const double beside_labels = area.left - std::max(46.0, 14 + widest);
  svg.text_upwards({beside_labels, area.top + area.height / 2}, title);
}

}  // namespace

void ValueRange::include(double value) {
  if (!std::isfinite(value)) return;
  const bool was_empty = empty();
  low = was_empty ? value : std::min(low, value);
  high = was_empty ? value : std::max(high, value);
}

std::vector<double> nice_ticks(const ValueRange& range, int count) {
  if (range.empty() || !(range.size() > 0) || count < 1) return {};
  const double step = round_up_to_nice(range.size() / count);
  std::vector<double> ticks;
  const auto first = static_cast<long long>(std::ceil(range.low / step - 1e-9));
  const auto last = static_cast<long long>(std::floor(range.high / step + 1e-9));
  for (long long i = first; i <= last; ++i) ticks.push_back(static_cast<double>(i) * step);
  return ticks;
}

std::vector<std::string> tick_labels(std::span<const double> ticks, bool reversed) {
  int decimals = 0;
  if (ticks.size() >= 2) {
    const double step = ticks[1] - ticks[0];
    decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  }
  std::vector<std::string> labels;
  for (const double tick : ticks) {
    const double value = reversed ? -tick : tick;
    labels.push_back(fmt::format("{:.{}f}", value + 0.0, decimals));  // + 0.0: no minus before 0
  }
  return labels;
}

std::string shortened(const std::string& text, std::size_t length) {
  if (text.size() <= length) return text;
  const std::size_t half = (length - 1) / 2;
  return text.substr(0, half) + "\u2026" + text.substr(text.size() - half);
}

void ChartArea::fit_equal_scale() {
  const double margin = 0.06 * std::max({x.size(), y.size(), 0.02});
  x = x.grown(margin);
  y = y.grown(margin);
  const double scale = std::min(width / x.size(), height / y.size());  // pixels per unit
  x = x.grown((width / scale - x.size()) / 2);
  y = y.grown((height / scale - y.size()) / 2);
}

void draw_x_axis(Svg& svg, const ChartArea& area, int ticks, std::string_view title) {
  draw_x_ticks(svg, area, nice_labeled_ticks(area.x, ticks, false), title);
}

void draw_y_axis(Svg& svg, const ChartArea& area, int ticks, std::string_view title,
                 bool reversed) {
  draw_y_ticks(svg, area, nice_labeled_ticks(area.y, ticks, reversed), title);
}

void draw_logarithmic_x_axis(Svg& svg, const ChartArea& area, std::string_view title) {
  draw_x_ticks(svg, area, logarithmic_ticks(area.x), title);
}

void draw_logarithmic_y_axis(Svg& svg, const ChartArea& area, std::string_view title) {
  draw_y_ticks(svg, area, logarithmic_ticks(area.y), title);
}

void draw_axes(Svg& svg, const ChartArea& area, const ProjectionPlane& plane) {
  draw_x_axis(svg, area, 6, plane.right.label());
  draw_y_axis(svg, area, 6, plane.up.label(), plane.up.reversed);
}

std::vector<std::pair<std::size_t, std::size_t>> continuous_ranges(
    std::span<const double> timestamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < timestamps.size(); ++i)
    steps.push_back(timestamps[i] - timestamps[i - 1]);
  const double longest = 3.5 * quantile(steps, 0.5);
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  for (std::size_t i = 0; i < timestamps.size(); ++i) {
    if (i == 0 || steps[i - 1] > longest) ranges.emplace_back(i, i);
    ranges.back().second = i + 1;
  }
  return ranges;
}

Eigen::Vector3d mean_up(const Trajectory& trajectory) {
  std::vector<Pose> cameras;
  for (const auto& [stamp, T] : trajectory) cameras.push_back(T);
  return mean_up(cameras);
}

Eigen::Vector3d up_axis(const Trajectory& trajectory) {
  const Eigen::Vector3d up = mean_up(trajectory);
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, up(axis)) * Eigen::Vector3d::Unit(axis);
}

ProjectionPlane plane_from_above(const Eigen::Vector3d& up_axis) {
  Eigen::Index up = 0;
  up_axis.cwiseAbs().maxCoeff(&up);
  const int right = up == 0 ? 1 : 0, ahead = up == 2 ? 1 : 2;
  // The drawing is right-handed: right x ahead must point to the viewer, that is, up.
  const Eigen::Vector3d toward = Eigen::Vector3d::Unit(right).cross(Eigen::Vector3d::Unit(ahead));
  return {{right, false}, {ahead, toward.dot(up_axis) < 0}};
}

ProjectionPlane plane_from_the_side(const Eigen::Vector3d& up_axis,
                                    std::span<const Eigen::Vector3d> points) {
  Eigen::Index up = 0;
  up_axis.cwiseAbs().maxCoeff(&up);
  std::array<ValueRange, 3> spread;
  for (const Eigen::Vector3d& p : points) {
    for (int i = 0; i < 3; ++i) spread[i].include(p(i));
  }
  const int first = up == 0 ? 1 : 0, second = up == 2 ? 1 : 2;
  const int right = spread[second].size() > spread[first].size() ? second : first;
  return {{right, false}, {static_cast<int>(up), up_axis(up) < 0}};
}

}  // namespace stillmap
