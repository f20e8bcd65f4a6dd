// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/chart_axes.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// The smallest of 1, 2, 5, 10 times a power of ten that is not below `step`.
double round_up_to_nice(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (step <= factor * power * (1 + 1e-9)) return factor * power;
  }
  return 10 * power;
}

}  // namespace

void Range::include(double value) {
  if (!std::isfinite(value)) return;
  const bool was_empty = empty();
  low = was_empty ? value : std::min(low, value);
  high = was_empty ? value : std::max(high, value);
}

std::vector<double> nice_ticks(const Range& range, int count) {
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

Eigen::Vector3d up_axis(const Trajectory& trajectory) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [stamp, T] : trajectory) sum -= T.rotation().col(1);  // image y points down
  if (sum.norm() < 1e-9) return Eigen::Vector3d::UnitZ();
  Eigen::Index axis = 0;
  sum.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, sum(axis)) * Eigen::Vector3d::Unit(axis);
}

PaperPlane plane_from_above(const Eigen::Vector3d& up_axis) {
  Eigen::Index up = 0;
  up_axis.cwiseAbs().maxCoeff(&up);
  const int right = up == 0 ? 1 : 0, ahead = up == 2 ? 1 : 2;
  // Right-handed on the paper: right x ahead must point to the viewer, that is, up.
  const Eigen::Vector3d toward = Eigen::Vector3d::Unit(right).cross(Eigen::Vector3d::Unit(ahead));
  return {{right, false}, {ahead, toward.dot(up_axis) < 0}};
}

PaperPlane plane_from_the_side(const Eigen::Vector3d& up_axis,
                               std::span<const Eigen::Vector3d> points) {
  Eigen::Index up = 0;
  up_axis.cwiseAbs().maxCoeff(&up);
  std::array<Range, 3> spread;
  for (const Eigen::Vector3d& p : points) {
    for (int i = 0; i < 3; ++i) spread[i].include(p(i));
  }
  const int first = up == 0 ? 1 : 0, second = up == 2 ? 1 : 2;
  const int right = spread[second].size() > spread[first].size() ? second : first;
  return {{right, false}, {static_cast<int>(up), up_axis(up) < 0}};
}

}  // namespace stillmap
