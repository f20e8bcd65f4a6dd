// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace stillmap {

/// Text made safe inside HTML and XML, also within attributes. Control characters become blanks,
/// bytes that are no UTF-8 become question marks.
std::string escape_markup(std::string_view text);

/// A drawing for inline SVG. Colors and strokes come from classes that the page's style sheet
/// defines, so that it follows the reader's light or dark setting. Coordinates are pixels of the
/// view box, y down.
class Svg {
 public:
  /// @param label what the drawing shows, for those who cannot see it
  Svg(double width, double height, std::string_view label);

  void line(double x1, double y1, double x2, double y2, std::string_view css_class,
            std::string_view style = "");
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class,
                std::string_view style = "");
  void polygon(std::span<const Eigen::Vector2d> points, std::string_view css_class);
  /// @param hint shown by the browser when the pointer rests on it; may be empty
  void rectangle(double x, double y, double width, double height, std::string_view css_class,
                 std::string_view hint = "", std::string_view style = "");
  void circle(double x, double y, double radius, std::string_view css_class,
              std::string_view hint = "");
  /// @param anchor start, middle or end
  void text(double x, double y, std::string_view content, std::string_view anchor,
            std::string_view css_class = "label");
  void text_upwards(double x, double y, std::string_view content);
  /// Everything until end_clip() is confined to the rectangle.
  void begin_clip(double x, double y, double width, double height);
  void end_clip();

  std::string finished() const { return body_ + "</svg>\n"; }

 private:
  std::string points_attribute(std::span<const Eigen::Vector2d> points) const;
  std::string body_;
};

}  // namespace stillmap
