// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/image_marks.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Start and scale of the font of a line, such that it stays in the image.
struct PlacedLine {
  cv::Point start;
  double scale = 0;
};

PlacedLine placed_line(const cv::Size& image, const std::string& text, const cv::Point& at) {
  constexpr double kScale = 0.42;
  constexpr int kMargin = 4;  // pixels
  const int width = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, nullptr).width;
  const int free = std::max(1, image.width - 2 * kMargin);
  const double scale = kScale * std::min(1.0, 1.0 * free / std::max(1, width));
  return {{std::clamp(at.x, kMargin, kMargin + std::max(0, free - width)), at.y}, scale};
}

}  // namespace

void write_line(cv::Mat& image, const std::string& text, const cv::Point& at) {
  const cv::Scalar white(255, 255, 255), black(0, 0, 0);
  const auto [start, scale] = placed_line(image.size(), text, at);
  cv::putText(image, text, start, cv::FONT_HERSHEY_SIMPLEX, scale, black, 3, cv::LINE_AA);
  cv::putText(image, text, start, cv::FONT_HERSHEY_SIMPLEX, scale, white, 1, cv::LINE_AA);
}

cv::Rect line_area(const cv::Size& image, const std::string& text, const cv::Point& at) {
  const auto [start, scale] = placed_line(image, text, at);
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &baseline);
  return {start.x, start.y - size.height, size.width, size.height + baseline};
}

cv::Mat grayed(const cv::Mat& color) {
  cv::Mat gray, image, mixed;
  cv::cvtColor(color, gray, cv::COLOR_BGR2GRAY);
  cv::cvtColor(gray, image, cv::COLOR_GRAY2BGR);
  cv::addWeighted(color, 0.35, image, 0.55, 0, mixed);
  return mixed;
}

}  // namespace stillmap
