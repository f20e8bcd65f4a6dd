// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace stillmap {

/// Escapes text for HTML and XML, including attributes. Control characters become blanks, bytes
/// that are not valid UTF-8 become question marks.
std::string escape_markup(std::string_view text);

/// Returns the style sheet of charts with every variable replaced by its light color, since most
/// viewers other than browsers do not support variables.
std::string light_chart_style();

/// An SVG drawing. Colors and strokes come from CSS classes (see page_style.hpp), so that the
/// drawing follows the reader's light or dark setting. Coordinates are pixels, y down.
class Svg {
 public:
  /// @param label  description of the drawing for screen readers
  Svg(double width, double height, std::string_view label);

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view css_class);
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class,
                std::string_view style = "");
  void polygon(std::span<const Eigen::Vector2d> points, std::string_view css_class);
  /// @param hint  tooltip; may be empty
  void rectangle(double x, double y, double width, double height, std::string_view css_class,
                 std::string_view hint = "", std::string_view style = "");
  void circle(const Eigen::Vector2d& center, double radius, std::string_view css_class,
              std::string_view hint = "");
  /// @param anchor  start, middle or end
  void text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor,
            std::string_view css_class = "label");
  /// Writes text of class "label" from bottom to top, centered on a point.
  void text_upwards(const Eigen::Vector2d& at, std::string_view content);
  /// Clips all drawing until end_clip() to the rectangle.
  void begin_clip(double x, double y, double width, double height);
  void end_clip();

  /// Returns the drawing as an element of an HTML page that has the style sheet.
  std::string element() const;
  /// Returns the drawing as a separate file, with the style sheet inside.
  std::string file() const;

 private:
  double width_, height_;
  std::string label_;
  std::string body_;
};

}  // namespace stillmap
