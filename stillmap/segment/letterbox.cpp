// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/letterbox.hpp"

#include "stillmap/base/trace.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kGray = 114;  // Padding value that YOLO networks are trained with.

/// Converts BGR bytes to three planes R, G, B of 0 to 1; the image covers `inner`.
void to_planes(const cv::Mat& bgr, std::span<float> planes) {
  constexpr float kUnit = 1.0F / 255.0F;
  const std::size_t plane = bgr.total();
  for (int y = 0; y < bgr.rows; ++y) {
    const auto* in = bgr.ptr<std::uint8_t>(y);
    float* r = planes.data() + static_cast<std::size_t>(y) * bgr.cols;
    float* g = r + plane;
    float* b = g + plane;
    for (int x = 0; x < bgr.cols; ++x) {
      b[x] = static_cast<float>(in[3 * x]) * kUnit;
      g[x] = static_cast<float>(in[3 * x + 1]) * kUnit;
      r[x] = static_cast<float>(in[3 * x + 2]) * kUnit;
    }
  }
}

}  // namespace

Letterbox::Letterbox(cv::Size image_size, cv::Size input_size)
    : scale(std::min(static_cast<double>(input_size.width) / image_size.width,
                     static_cast<double>(input_size.height) / image_size.height)),
      image(image_size),
      input(input_size) {
  inner.width = std::clamp(cvRound(image.width * scale), 1, input.width);
  inner.height = std::clamp(cvRound(image.height * scale), 1, input.height);
  pad_x = (input.width - inner.width) / 2;
  pad_y = (input.height - inner.height) / 2;
}

cv::Point2f Letterbox::to_image(cv::Point2f p) const {
  return {static_cast<float>((p.x - pad_x) * image.width / inner.width),
          static_cast<float>((p.y - pad_y) * image.height / inner.height)};
}

cv::Point2f Letterbox::to_input(cv::Point2f p) const {
  return {static_cast<float>(p.x * inner.width / image.width + pad_x),
          static_cast<float>(p.y * inner.height / image.height + pad_y)};
}

void Letterbox::fill(const cv::Mat& color, std::span<float> planes) const {
  const TraceScope scope("letterbox");
  CV_Assert(planes.size() == 3 * static_cast<std::size_t>(input.area()));
  cv::Mat scaled;
  const int how = inner.width < image.width ? cv::INTER_AREA : cv::INTER_LINEAR;
  cv::resize(color, scaled, inner, 0, 0, how);
  if (inner != input) {
    const int x = static_cast<int>(pad_x), y = static_cast<int>(pad_y);
    cv::copyMakeBorder(scaled, scaled, y, input.height - inner.height - y, x,
                       input.width - inner.width - x, cv::BORDER_CONSTANT,
                       cv::Scalar(kGray, kGray, kGray));
  }
  to_planes(scaled, planes);
}

}  // namespace stillmap
