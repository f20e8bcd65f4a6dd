// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/html_page.hpp"

#include "stillmap/base/base64.hpp"
#include "stillmap/report/page_style.hpp"
#include "stillmap/report/svg.hpp"
#include "stillmap/sensor/jpeg_image.hpp"

#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kJpegQuality = 86;

std::string page_style() {
  return fmt::format(
      ":root {{ color-scheme: light dark; {0} }}\n{1}{2}@media print {{ :root {{ {0} --shadow: "
      "none; }} }}\n",
      kLightColors, kPageStyle, kChartStyle);
}

}  // namespace

std::string html_page(const std::string& title, const std::string& body,
                      const std::string& footer) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}"
      "<footer>{}</footer>\n</main>\n</body>\n</html>\n",
      escape_markup(title), page_style(), body, footer);
}

std::string html_card(const std::string& heading, const std::string& content,
                      const std::string& note) {
  if (content.empty()) return "";
  return fmt::format("<section><h2>{}</h2>\n{}{}</section>\n", heading,
                     note.empty() ? "" : "<p class=\"note\">" + note + "</p>\n", content);
}

std::string html_figure(const CaptionedImage& image) {
  if (image.image.empty()) return "";
  const std::vector<unsigned char> jpeg = encode_jpeg(image.image, kJpegQuality);
  return fmt::format(
      "<figure><img alt=\"{0}\" width=\"{1}\" height=\"{2}\" src=\"data:image/jpeg;base64,{3}\">"
      "<figcaption>{0}</figcaption></figure>\n",
      escape_markup(image.caption), image.image.cols, image.image.rows,
      base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()}));
}

std::string wide_chart(const std::string& chart) {
  return chart.empty() ? "" : "<div class=\"scroll\">" + chart + "</div>\n";
}

}  // namespace stillmap
