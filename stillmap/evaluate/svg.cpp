// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/svg.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Length of the UTF-8 sequence at the start of `text` (RFC 3629); 0 if it is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  std::size_t length = 0;
  if (lead < 0x80) {
    length = 1;
  } else if (lead >= 0xc2 && lead <= 0xdf) {
    length = 2;
  } else if (lead >= 0xe0 && lead <= 0xef) {
    length = 3;
  } else if (lead >= 0xf0 && lead <= 0xf4) {
    length = 4;
  }
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  return length;
}

std::string escape_character(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    case '\n':
    case '\t':
      return std::string(1, c);
    default:
      return std::string(1, static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c);
  }
}

std::string style_attribute(std::string_view style) {
  return style.empty() ? "" : fmt::format(" style=\"{}\"", style);
}

std::string hint_element(std::string_view hint) {
  return hint.empty() ? "" : fmt::format("<title>{}</title>", escape_markup(hint));
}

}  // namespace

std::string escape_markup(std::string_view text) {
  std::string escaped;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 1) {
      escaped += escape_character(text[0]);
    } else {
      escaped += length == 0 ? std::string_view("?") : text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return escaped;
}

Svg::Svg(double width, double height, std::string_view label)
    : body_(fmt::format("<svg viewBox=\"0 0 {:g} {:g}\" role=\"img\" aria-label=\"{}\">\n", width,
                        height, escape_markup(label))) {}

void Svg::line(double x1, double y1, double x2, double y2, std::string_view css_class,
               std::string_view style) {
  body_ += fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"{}\"{}/>\n", x1, y1,
      x2, y2, css_class, style_attribute(style));
}

std::string Svg::points_attribute(std::span<const Eigen::Vector2d> points) const {
  std::string text;
  for (const Eigen::Vector2d& p : points) {
    text += fmt::format("{}{:.1f},{:.1f}", text.empty() ? "" : " ", p.x(), p.y());
  }
  return text;
}

void Svg::polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class,
                   std::string_view style) {
  if (points.empty()) return;
  body_ += fmt::format("<polyline points=\"{}\" class=\"{}\"{}/>\n", points_attribute(points),
                       css_class, style_attribute(style));
}

void Svg::polygon(std::span<const Eigen::Vector2d> points, std::string_view css_class) {
  if (points.empty()) return;
  body_ +=
      fmt::format("<polygon points=\"{}\" class=\"{}\"/>\n", points_attribute(points), css_class);
}

void Svg::rectangle(double x, double y, double width, double height, std::string_view css_class,
                    std::string_view hint, std::string_view style) {
  body_ += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
      "class=\"{}\"{}>{}</rect>\n",
      x, y, width, height, css_class, style_attribute(style), hint_element(hint));
}

void Svg::circle(double x, double y, double radius, std::string_view css_class,
                 std::string_view hint) {
  body_ +=
      fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" class=\"{}\">{}</circle>\n", x,
                  y, radius, css_class, hint_element(hint));
}

void Svg::text(double x, double y, std::string_view content, std::string_view anchor,
               std::string_view css_class) {
  body_ +=
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" class=\"{}\">{}</text>\n", x,
                  y, anchor, css_class, escape_markup(content));
}

void Svg::text_upwards(double x, double y, std::string_view content) {
  body_ += fmt::format(
      "<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"middle\" class=\"label\" "
      "transform=\"rotate(-90 {0:.1f} {1:.1f})\">{2}</text>\n",
      x, y, escape_markup(content));
}

void Svg::begin_clip(double x, double y, double width, double height) {
  // A nested drawing clips without an id, which would have to be unique in the whole page.
  body_ += fmt::format(
      "<svg x=\"{0:.1f}\" y=\"{1:.1f}\" width=\"{2:.1f}\" height=\"{3:.1f}\" "
      "viewBox=\"{0:.1f} {1:.1f} {2:.1f} {3:.1f}\">\n",
      x, y, width, height);
}

void Svg::end_clip() { body_ += "</svg>\n"; }

}  // namespace stillmap
