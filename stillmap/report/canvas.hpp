// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string_view>

#include <Eigen/Core>

namespace stillmap {

/// A drawing of lines and text, as a vector graphic (Svg) or as pixels (Raster). The classes of the
/// style sheet (page_style.hpp) give colors and strokes. Coordinates are pixels, y down.
class Canvas {
 public:
  virtual ~Canvas() = default;

  virtual void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                    std::string_view css_class) = 0;
  virtual void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class) = 0;
  virtual void rectangle(double x, double y, double width, double height,
                         std::string_view css_class) = 0;
  /// @param anchor  start, middle or end
  virtual void text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor,
                    std::string_view css_class) = 0;
  /// Writes text of class "label".
  void text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor) {
    text(at, content, anchor, "label");
  }
  /// Writes text of class "label" from bottom to top, centered on a point.
  virtual void text_upwards(const Eigen::Vector2d& at, std::string_view content) = 0;
  /// Clips all drawing until end_clip() to the rectangle.
  virtual void begin_clip(double x, double y, double width, double height) = 0;
  virtual void end_clip() = 0;
};

}  // namespace stillmap
