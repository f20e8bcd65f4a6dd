// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/dynamic_mask.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {

cv::Mat1b dynamic_mask(const SegmentedFrame& frame,
                       const std::function<bool(const Instance&)>& counts, cv::Size size,
                       int dilation_px) {
  cv::Mat1b mask = cv::Mat1b::zeros(size);
  for (const Instance& instance : frame.instances) {
    if (!counts(instance)) continue;
    const cv::Rect box = instance.box & cv::Rect(cv::Point(), size);
    if (box.empty()) continue;
    if (instance.mask.empty()) {
      mask(box) = 255;
    } else {
      mask(box) |= instance.mask(box - instance.box.tl());
    }
  }
  if (dilation_px > 0) {
    const cv::Size kernel(2 * dilation_px + 1, 2 * dilation_px + 1);
    cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, kernel));
  }
  return mask;
}

cv::Mat1b dynamic_mask(const SegmentedFrame& frame, const std::vector<std::string>& classes,
                       cv::Size size, int dilation_px) {
  const auto named = [&](const Instance& instance) {
    return classes.empty() ||
           std::find(classes.begin(), classes.end(), instance.class_name) != classes.end();
  };
  return dynamic_mask(frame, named, size, dilation_px);
}

}  // namespace stillmap
