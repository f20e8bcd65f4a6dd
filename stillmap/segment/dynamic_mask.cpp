// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/dynamic_mask.hpp"

#include <algorithm>

namespace stillmap {

cv::Mat1b dynamic_mask(const SegmentedFrame& frame, const std::vector<std::string>& classes,
                       cv::Size size) {
  cv::Mat1b mask = cv::Mat1b::zeros(size);
  for (const Instance& instance : frame.instances) {
    if (std::find(classes.begin(), classes.end(), instance.class_name) == classes.end()) continue;
    const cv::Rect box = instance.box & cv::Rect(cv::Point(), size);
    if (box.empty()) continue;
    if (instance.mask.empty()) {
      mask(box) = 255;
    } else {
      mask(box) |= instance.mask(box - instance.box.tl());
    }
  }
  return mask;
}

}  // namespace stillmap
