// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/small_frame.hpp"

#include "stillmap/base/trace.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr double kSmallWidth = 320;  // pixels

cv::Rect small_box(const cv::Rect& box, const SmallFrame& frame) {
  const int s = frame.shrink;
  const cv::Point first(box.x / s, box.y / s);
  const cv::Point last((box.br().x + s - 1) / s, (box.br().y + s - 1) / s);
  return cv::Rect(first, last) & frame.bounds();
}

}  // namespace

SmallFrame::SmallFrame(const RgbdFrame& frame)
    : shrink(std::max(1, cvRound(frame.gray.cols / kSmallWidth))), full_size(frame.gray.size()) {
  const cv::Size size(std::max(1, full_size.width / shrink),
                      std::max(1, full_size.height / shrink));
  const cv::Rect whole(0, 0, size.width * shrink, size.height * shrink);
  cv::resize(frame.gray(whole), gray, size, 0, 0, cv::INTER_AREA);
  depth = cv::Mat1f(size);
  for (int y = 0; y < size.height; ++y) {
    const auto* in = frame.depth.ptr<float>(y * shrink);
    auto* out = depth.ptr<float>(y);
    for (int x = 0; x < size.width; ++x) out[x] = in[x * shrink];
  }
}

SmallMask shrink_mask(const Instance& instance, const SmallFrame& frame) {
  SmallMask small{small_box(instance.box, frame), {}};
  small.mask = cv::Mat1b(small.window.size(), 255);
  if (instance.mask.empty() || small.window.empty()) return small;
  const int s = frame.shrink;
  // Columns of the full mask.
  std::vector<int> column(static_cast<std::size_t>(small.window.width));
  for (int x = 0; x < small.window.width; ++x) {
    column[static_cast<std::size_t>(x)] =
        std::clamp((small.window.x + x) * s + s / 2 - instance.box.x, 0, instance.box.width - 1);
  }
  for (int y = 0; y < small.window.height; ++y) {
    const int row =
        std::clamp((small.window.y + y) * s + s / 2 - instance.box.y, 0, instance.box.height - 1);
    const auto* in = instance.mask.ptr<std::uint8_t>(row);
    auto* out = small.mask.ptr<std::uint8_t>(y);
    for (std::size_t x = 0; x < column.size(); ++x) out[x] = in[column[x]];
  }
  return small;
}

Instance enlarge_mask(const SmallMask& small, const SmallFrame& frame, const Instance& model) {
  const TraceScope scope("enlarging");
  Instance instance{.class_id = model.class_id,
                    .class_name = model.class_name,
                    .confidence = model.confidence,
                    .box = {},
                    .mask = {}};
  const cv::Rect bounds = small.mask.empty() ? cv::Rect() : cv::boundingRect(small.mask);
  if (bounds.empty()) return instance;
  const int s = frame.shrink;
  const cv::Point corner = small.window.tl() + bounds.tl();
  instance.box = cv::Rect(corner * s, bounds.size() * s);
  // The last small pixels also represent the remainder of an image whose size is no multiple.
  if (corner.x + bounds.width == frame.size().width) {
    instance.box.width = frame.full_size.width - instance.box.x;
  }
  if (corner.y + bounds.height == frame.size().height) {
    instance.box.height = frame.full_size.height - instance.box.y;
  }
  cv::Mat mask;
  cv::resize(small.mask(bounds), mask, bounds.size() * s, 0, 0, cv::INTER_NEAREST);
  cv::copyMakeBorder(mask, instance.mask, 0, instance.box.height - mask.rows, 0,
                     instance.box.width - mask.cols, cv::BORDER_REPLICATE);
  return instance;
}

}  // namespace stillmap
