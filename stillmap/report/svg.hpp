// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/canvas.hpp"

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
/// drawing follows the reader's light or dark setting.
class Svg : public Canvas {
 public:
  /// @param label  description of the drawing for screen readers
  Svg(double width, double height, std::string_view label);

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            std::string_view css_class) override;
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class) override {
    polyline(points, css_class, "");
  }
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class,
                std::string_view style);
  void polygon(std::span<const Eigen::Vector2d> points, std::string_view css_class);
  void rectangle(double x, double y, double width, double height,
                 std::string_view css_class) override {
    rectangle(x, y, width, height, css_class, "");
  }
  /// @param hint  tooltip; may be empty
  void rectangle(double x, double y, double width, double height, std::string_view css_class,
                 std::string_view hint, std::string_view style = "");
  void circle(const Eigen::Vector2d& center, double radius, std::string_view css_class,
              std::string_view hint = "");
  using Canvas::text;
  void text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor,
            std::string_view css_class) override;
  void text_upwards(const Eigen::Vector2d& at, std::string_view content) override;
  void begin_clip(double x, double y, double width, double height) override;
  void end_clip() override;

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
