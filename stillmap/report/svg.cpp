// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/svg.hpp"

#include "stillmap/report/page_style.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Length of the UTF-8 sequence at the start of `text` [bytes] (RFC 3629); 0 if it is not valid.
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

std::string points_attribute(std::span<const Eigen::Vector2d> points) {
  std::string text;
  for (const Eigen::Vector2d& p : points) {
    text += fmt::format("{}{:.1f},{:.1f}", text.empty() ? "" : " ", p.x(), p.y());
  }
  return text;
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

std::string light_chart_style() {
  std::string style(kChartStyle);
  std::string_view rest = kLightColors;
  for (auto name = rest.find("--"); name != rest.npos; name = rest.find("--")) {
    const auto colon = rest.find(':', name), end = rest.find(';', colon);
    const std::string variable = fmt::format("var({})", rest.substr(name, colon - name));
    const std::string_view value = rest.substr(colon + 2, end - colon - 2);
    for (auto at = style.find(variable); at != style.npos; at = style.find(variable))
      style.replace(at, variable.size(), value);
    rest.remove_prefix(end);
  }
  return style;
}

Svg::Svg(double width, double height, std::string_view label)
    : width_(width), height_(height), label_(escape_markup(label)) {}

void Svg::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view css_class) {
  body_ +=
      fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"{}\"/>\n",
                  from.x(), from.y(), to.x(), to.y(), css_class);
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

void Svg::circle(const Eigen::Vector2d& center, double radius, std::string_view css_class,
                 std::string_view hint) {
  body_ +=
      fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" class=\"{}\">{}</circle>\n",
                  center.x(), center.y(), radius, css_class, hint_element(hint));
}

void Svg::text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor,
               std::string_view css_class) {
  body_ +=
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" class=\"{}\">{}</text>\n",
                  at.x(), at.y(), anchor, css_class, escape_markup(content));
}

void Svg::text_upwards(const Eigen::Vector2d& at, std::string_view content) {
  body_ += fmt::format(
      "<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"middle\" class=\"label\" "
      "transform=\"rotate(-90 {0:.1f} {1:.1f})\">{2}</text>\n",
      at.x(), at.y(), escape_markup(content));
}

void Svg::begin_clip(double x, double y, double width, double height) {
  // A nested drawing clips without an id, which would have to be unique in the whole page.
  body_ += fmt::format(
      "<svg x=\"{0:.1f}\" y=\"{1:.1f}\" width=\"{2:.1f}\" height=\"{3:.1f}\" "
      "viewBox=\"{0:.1f} {1:.1f} {2:.1f} {3:.1f}\">\n",
      x, y, width, height);
}

void Svg::end_clip() { body_ += "</svg>\n"; }

std::string Svg::element() const {
  return fmt::format("<svg viewBox=\"0 0 {:g} {:g}\" role=\"img\" aria-label=\"{}\">\n{}</svg>\n",
                     width_, height_, label_, body_);
}

std::string Svg::file() const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" "
      "viewBox=\"0 0 {0:g} {1:g}\" role=\"img\" aria-label=\"{2}\">\n<style>{3}</style>\n"
      "<rect width=\"100%\" height=\"100%\" class=\"paper\"/>\n{4}</svg>\n",
      width_, height_, label_, light_chart_style(), body_);
}

}  // namespace stillmap
