// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <array>
#include <span>
#include <string>
#include <vector>

/// What every chart needs, drawn by whatever means: tick values, and the planes a 3D path is looked
/// at in.
namespace stillmap {

/// A closed interval of values; empty while low > high.
struct Range {
  double low = 1, high = -1;
  bool empty() const { return low > high; }
  double size() const { return empty() ? 0 : high - low; }
  double middle() const { return (low + high) / 2; }
  void include(double value);
  /// Grown by `margin` on both sides.
  Range grown(double margin) const { return {low - margin, high + margin}; }
};

/// Round values (1, 2 or 5 times a power of ten apart) inside the range, about `count` of them.
std::vector<double> nice_ticks(const Range& range, int count);

/// The ticks' labels with as many decimals as tell them apart: 0.0, 0.5, 1.0. For a reversed axis,
/// whose ticks are the negative values, `reversed` gives the values themselves.
std::vector<std::string> tick_labels(std::span<const double> ticks, bool reversed = false);

/// One world axis laid along a side of the paper.
struct PaperAxis {
  int axis = 0;           ///< 0 x, 1 y, 2 z
  bool reversed = false;  ///< values fall to the right (or upwards)
  double of(const Eigen::Vector3d& p) const { return reversed ? -p(axis) : p(axis); }
  /// "x [m]"
  std::string label() const { return std::string(1, "xyz"[axis]) + " [m]"; }
};

/// A world seen along one of its axes, without mirroring.
struct PaperPlane {
  PaperAxis right, up;
  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {right.of(p), up.of(p)}; }
};

/// The world axis nearest to "up" (a signed unit vector): hand-held and mounted cameras are upright
/// on average, so the mean of their upward image direction tells. +z for an empty trajectory.
Eigen::Vector3d up_axis(const Trajectory& trajectory);

/// The world from above: right x up = toward the viewer.
PaperPlane plane_from_above(const Eigen::Vector3d& up_axis);
/// The world from the side, its up axis upwards; the horizontal axis is the one in which the points
/// spread wider.
PaperPlane plane_from_the_side(const Eigen::Vector3d& up_axis,
                               std::span<const Eigen::Vector3d> points);

}  // namespace stillmap
