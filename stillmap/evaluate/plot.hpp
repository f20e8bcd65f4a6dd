// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/canvas.hpp"
#include "stillmap/evaluate/chart_axes.hpp"

namespace stillmap {

/// Maps the meters of a plane to pixels of a picture, with one scale for both axes.
class Plot {
 public:
  /// @param area of the picture [pixels]
  /// @param x, y what must be in it [m]; a margin is added, and one of them grows to fill the area
  Plot(const cv::Rect2d& area, Range x, Range y);

  const cv::Rect2d& area() const { return area_; }
  const Range& x() const { return x_; }
  const Range& y() const { return y_; }
  double scale() const { return scale_; }  ///< pixels per meter
  double px(double x) const { return area_.x + (x - x_.low) * scale_; }
  double py(double y) const { return area_.y + (y_.high - y) * scale_; }
  cv::Point2d operator()(const Eigen::Vector2d& p) const { return {px(p.x()), py(p.y())}; }

 private:
  cv::Rect2d area_;
  Range x_, y_;
  double scale_ = 1;
};

/// Grid lines, their values and the axis's name. @param cap height of the capitals [pixels]
void draw_x_axis(Canvas& canvas, const Plot& plot, const PaperAxis& axis, double cap);
void draw_y_axis(Canvas& canvas, const Plot& plot, const PaperAxis& axis, double cap);

}  // namespace stillmap
