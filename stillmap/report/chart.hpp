// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/report/svg.hpp"

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

/// Common parts of all charts: value ranges, axes, and the planes in which 3D paths are drawn.
namespace stillmap {

/// A closed interval of values; empty while low > high.
struct ValueRange {
  double low = 1, high = -1;
  bool empty() const { return low > high; }
  double size() const { return empty() ? 0 : high - low; }
  /// Extends the range to a value; values that are not finite are ignored.
  void include(double value);
  /// Returns the range extended by `margin` on both sides.
  ValueRange grown(double margin) const { return {low - margin, high + margin}; }
};

/// Returns about `count` round values inside the range, 1, 2 or 5 times a power of ten apart.
std::vector<double> nice_ticks(const ValueRange& range, int count);

/// Returns the labels of the ticks with the decimals needed to distinguish them: 0.0, 0.5, 1.0. A
/// reversed axis has ticks at negated values; with `reversed` the labels show the values
/// themselves.
std::vector<std::string> tick_labels(std::span<const double> ticks, bool reversed = false);

/// Returns a text of at most `length` bytes, with an ellipsis for the middle of a longer one.
std::string shortened(const std::string& text, std::size_t length);

/// The data area of a chart: a rectangle of the drawing [pixels] and the values that it shows.
struct ChartArea {
  double left = 0, top = 0, width = 1, height = 1;
  ValueRange x, y;
  double px(double value) const { return left + (value - x.low) / x.size() * width; }
  double py(double value) const { return top + (y.high - value) / y.size() * height; }
  Eigen::Vector2d pixel(const Eigen::Vector2d& p) const { return {px(p.x()), py(p.y())}; }
  double right() const { return left + width; }
  double bottom() const { return top + height; }
  /// Adds a margin, then extends one range so that one unit is equally long on both axes.
  void fit_equal_scale();
};

/// Draws grid lines, tick labels and the title of an axis. Labels that would touch another one are
/// left out. The title of a y axis is beside the labels, up to 70 pixels left of the area.
/// @param ticks  approximate number of ticks
void draw_x_axis(Svg& svg, const ChartArea& area, int ticks, std::string_view title);
void draw_y_axis(Svg& svg, const ChartArea& area, int ticks, std::string_view title,
                 bool reversed = false);

/// The same for an axis whose values are decimal logarithms of the labeled values, with grid lines
/// at 1, 2 and 5 times the powers of ten; the lines at 2 and 5 are labeled on short axes.
void draw_logarithmic_x_axis(Svg& svg, const ChartArea& area, std::string_view title);
void draw_logarithmic_y_axis(Svg& svg, const ChartArea& area, std::string_view title);

/// Returns the [first, end) indices of the parts of the samples without gaps. A gap is a time step
/// longer than 3.5 times the median step, because tracking was lost.
std::vector<std::pair<std::size_t, std::size_t>> continuous_ranges(
    std::span<const double> timestamps);

/// A world axis as an axis of a drawing.
struct PlaneAxis {
  int axis = 0;           ///< 0 x, 1 y, 2 z
  bool reversed = false;  ///< values decrease to the right (or upwards)
  double of(const Eigen::Vector3d& p) const { return reversed ? -p(axis) : p(axis); }
  /// Returns the label of the axis, such as "x [m]".
  std::string label() const { return std::string(1, "xyz"[axis]) + " [m]"; }
};

/// An orthographic projection of the world along one of its axes, not mirrored.
struct ProjectionPlane {
  PlaneAxis right, up;
  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {right.of(p), up.of(p)}; }
};

/// Returns the mean upward direction of the cameras of a trajectory.
Eigen::Vector3d mean_up(const Trajectory& trajectory);

/// Returns the world axis (a signed unit vector) nearest to mean_up().
Eigen::Vector3d up_axis(const Trajectory& trajectory);

/// Returns the view of the world from above: right x up points to the viewer.
ProjectionPlane plane_from_above(const Eigen::Vector3d& up_axis);
/// Returns the view of the world from the side, its up axis upwards; the horizontal axis is the one
/// along which the points spread more.
ProjectionPlane plane_from_the_side(const Eigen::Vector3d& up_axis,
                                    std::span<const Eigen::Vector3d> points);

/// Draws the axes of a projection.
void draw_axes(Svg& svg, const ChartArea& area, const ProjectionPlane& plane);

}  // namespace stillmap
