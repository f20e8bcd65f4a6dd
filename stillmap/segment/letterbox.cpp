// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/letterbox.hpp"

#include "stillmap/base/trace.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kGray = 114;  // Padding value that YOLO networks are trained with.

/// Writes BGR bytes in the format of a network's input.
void write_pixels(const cv::Mat& bgr, const PixelFormat& format, std::span<float> values) {
  const std::size_t plane = format.channels_last ? 1 : bgr.total();
  const std::size_t step = format.channels_last ? 3 : 1;
  const auto scale = format.scale, offset = format.offset;
  for (int y = 0; y < bgr.rows; ++y) {
    const auto* in = bgr.ptr<std::uint8_t>(y);
    float* first = values.data() + step * static_cast<std::size_t>(y) * bgr.cols;
    float* r = first + (format.bgr ? 2 * plane : 0);
    float* g = first + plane;
    float* b = first + (format.bgr ? 0 : 2 * plane);
    for (std::size_t x = 0; x < static_cast<std::size_t>(bgr.cols); ++x) {
      b[step * x] = static_cast<float>(in[3 * x]) * scale[0] + offset[0];
      g[step * x] = static_cast<float>(in[3 * x + 1]) * scale[1] + offset[1];
      r[step * x] = static_cast<float>(in[3 * x + 2]) * scale[2] + offset[2];
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

Letterbox Letterbox::stretched(cv::Size image_size, cv::Size input_size) {
  Letterbox whole(image_size, input_size);
  whole.inner = input_size;
  whole.pad_x = whole.pad_y = 0;
  return whole;
}

Letterbox Letterbox::in_corner(cv::Size image_size, cv::Size input_size) {
  Letterbox corner(image_size, input_size);
  corner.pad_x = corner.pad_y = 0;
  return corner;
}

cv::Point2f Letterbox::to_image(cv::Point2f p) const {
  return {static_cast<float>((p.x - pad_x) * image.width / inner.width),
          static_cast<float>((p.y - pad_y) * image.height / inner.height)};
}

cv::Point2f Letterbox::to_input(cv::Point2f p) const {
  return {static_cast<float>(p.x * inner.width / image.width + pad_x),
          static_cast<float>(p.y * inner.height / image.height + pad_y)};
}

void Letterbox::fill(const cv::Mat& color, std::span<float> values,
                     const PixelFormat& format) const {
  const TraceScope scope("letterbox");
  CV_Assert(values.size() == 3 * static_cast<std::size_t>(input.area()));
  cv::Mat scaled;
  const int how = inner.width < image.width ? cv::INTER_AREA : cv::INTER_LINEAR;
  cv::resize(color, scaled, inner, 0, 0, how);
  if (inner != input) {
    const int x = static_cast<int>(pad_x), y = static_cast<int>(pad_y);
    cv::copyMakeBorder(scaled, scaled, y, input.height - inner.height - y, x,
                       input.width - inner.width - x, cv::BORDER_CONSTANT,
                       cv::Scalar(kGray, kGray, kGray));
  }
  write_pixels(scaled, format, values);
}

}  // namespace stillmap
