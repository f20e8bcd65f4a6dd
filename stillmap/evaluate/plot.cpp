// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/plot.hpp"

#include <algorithm>

namespace stillmap {
namespace {

const cv::Scalar kInk(35, 30, 28), kSoftInk(110, 102, 96), kGrid(236, 233, 230);

}  // namespace

Plot::Plot(const cv::Rect2d& area, Range x, Range y) : area_(area) {
  const double margin = 0.06 * std::max({x.size(), y.size(), 1e-3});
  x_ = x.grown(margin);
  y_ = y.grown(margin);
  scale_ = std::min(area.width / x_.size(), area.height / y_.size());
  x_ = x_.grown((area.width / scale_ - x_.size()) / 2);
  y_ = y_.grown((area.height / scale_ - y_.size()) / 2);
}

void draw_x_axis(Canvas& canvas, const Plot& plot, const PaperAxis& axis, double cap) {
  const std::vector<double> ticks = nice_ticks(plot.x(), 5);
  const std::vector<std::string> labels = tick_labels(ticks);
  const double bottom = plot.area().br().y;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double x = plot.px(ticks[i]);
    canvas.line({x, plot.area().y}, {x, bottom}, kGrid, 1);
    canvas.text(labels[i], {x, bottom + 2.1 * cap}, cap, kSoftInk, Anchor::kCenter);
  }
  canvas.text(axis.label(), {plot.area().x + plot.area().width / 2, bottom + 4.7 * cap}, cap, kInk,
              Anchor::kCenter);
}

void draw_y_axis(Canvas& canvas, const Plot& plot, const PaperAxis& axis, double cap) {
  const std::vector<double> ticks = nice_ticks(plot.y(), 5);
  const std::vector<std::string> labels = tick_labels(ticks, axis.reversed);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double y = plot.py(ticks[i]);
    canvas.line({plot.area().x, y}, {plot.area().br().x, y}, kGrid, 1);
    canvas.text(labels[i], {plot.area().x - 0.8 * cap, y + cap / 2}, cap, kSoftInk, Anchor::kRight);
  }
  canvas.text_upwards(
      axis.label(), {plot.area().x - 5.2 * cap, plot.area().y + plot.area().height / 2}, cap, kInk);
}

}  // namespace stillmap
