// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/image_marks.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {

void write_line(cv::Mat& image, const std::string& text, const cv::Point& at) {
  const cv::Scalar white(255, 255, 255), black(0, 0, 0);
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, black, 3, cv::LINE_AA);
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, white, 1, cv::LINE_AA);
}

cv::Mat grayed(const cv::Mat& color) {
  cv::Mat gray, image, mixed;
  cv::cvtColor(color, gray, cv::COLOR_BGR2GRAY);
  cv::cvtColor(gray, image, cv::COLOR_GRAY2BGR);
  cv::addWeighted(color, 0.35, image, 0.55, 0, mixed);
  return mixed;
}

}  // namespace stillmap
