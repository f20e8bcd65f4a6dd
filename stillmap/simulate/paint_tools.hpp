// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/paint.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

/// Brushes and pens of the paint_*.cpp files.
namespace stillmap::simulate::paint {

inline constexpr double kTau = 2 * std::numbers::pi;
inline const cv::Scalar kInk(45, 42, 40), kPaper(228, 234, 236);

inline void fill(cv::Mat& image, cv::Rect area, const cv::Scalar& color) {
  cv::rectangle(image, area, color, cv::FILLED);
}
inline void line(cv::Mat& image, cv::Point a, cv::Point b, const cv::Scalar& color,
                 int thickness = 1) {
  cv::line(image, a, b, color, thickness, cv::LINE_AA);
}
inline void disc(cv::Mat& image, cv::Point at, int radius, const cv::Scalar& color,
                 int thickness = cv::FILLED) {
  cv::circle(image, at, radius, color, thickness, cv::LINE_AA);
}
inline void write(cv::Mat& image, const std::string& text, cv::Point at, double size,
                  const cv::Scalar& color, int thickness = 1, int font = cv::FONT_HERSHEY_SIMPLEX) {
  cv::putText(image, text, at, font, size, color, thickness, cv::LINE_AA);
}
inline void polygon(cv::Mat& image, const std::vector<cv::Point>& points, const cv::Scalar& color) {
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{points}, color, cv::LINE_AA);
}

inline std::string word(Random& random) {
  static constexpr std::array kSyllables{"ka", "lo",  "mi", "ter", "ra", "sen", "vo", "du",
                                         "ne", "bar", "is", "on",  "pe", "qui", "fa", "th"};
  std::string text;
  for (int i = random.integer(1, 4); i > 0; --i) text += random.pick(kSyllables);
  return text;
}

inline std::string title(Random& random) {
  std::string text = word(random);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return std::toupper(c); });
  return text;
}

/// Lines of small words inside `area`.
inline void text_block(cv::Mat& image, cv::Rect area, double size, const cv::Scalar& color,
                       Random& random) {
  const int leading = static_cast<int>(34 * size);
  for (int y = area.y + leading; y <= area.br().y; y += leading) {
    std::string text;
    while (static_cast<double>(text.size()) * 18 * size < area.width * 0.8)
      text += word(random) + " ";
    if (random.chance(0.2)) text.resize(text.size() / 2);
    write(image, text, {area.x, y}, size, color, 1);
  }
}

inline void frame(cv::Mat& image, const cv::Scalar& color, int width) {
  cv::rectangle(image, {width / 2, width / 2, image.cols - width, image.rows - width}, color,
                width);
}

}  // namespace stillmap::simulate::paint
