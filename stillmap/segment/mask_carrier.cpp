// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_carrier.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

Instance grown(const Instance& instance, cv::Size image, int radius) {
  const cv::Rect wide(instance.box.x - radius, instance.box.y - radius,
                      instance.box.width + 2 * radius, instance.box.height + 2 * radius);
  Instance result = instance;
  result.box = wide & cv::Rect(cv::Point(), image);
  if (instance.mask.empty()) return result;
  cv::Mat mask = cv::Mat::zeros(result.box.size(), CV_8UC1);
  instance.mask.copyTo(mask(instance.box - result.box.tl()));
  const cv::Size kernel(2 * radius + 1, 2 * radius + 1);
  cv::dilate(mask, result.mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, kernel));
  return result;
}

}  // namespace

SegmentedFrame carry_forward(const SegmentedFrame& source, const RgbdFrame&,
                             const RgbdFrame& target_frame, const CarryOptions& options) {
  SegmentedFrame carried;
  carried.frame_index = target_frame.index;
  carried.source_index = source.source_index;
  const int radius = cvCeil(options.growth * static_cast<double>(carried.age()));
  for (const Instance& instance : source.instances) {
    carried.instances.push_back(grown(instance, target_frame.grey.size(), radius));
  }
  return carried;
}

void MaskCarrier::push(RgbdFramePtr frame) {
  frames_.push_back(std::move(frame));
  while (frames_.size() > static_cast<std::size_t>(options_.max_age) + 1) frames_.pop_front();
}

void MaskCarrier::set(SegmentedFramePtr masks) {
  if (!masks_ || masks->source_index > masks_->source_index) masks_ = std::move(masks);
}

SegmentedFramePtr MaskCarrier::current() const {
  if (!masks_ || frames_.empty()) return nullptr;
  const RgbdFrame& target = *frames_.back();
  if (target.index == masks_->frame_index) return masks_;
  const auto is_source = [&](const auto& frame) { return frame->index == masks_->frame_index; };
  const auto source = std::find_if(frames_.begin(), frames_.end(), is_source);
  if (source == frames_.end()) return nullptr;
  return std::make_shared<SegmentedFrame>(carry_forward(*masks_, **source, target, options_));
}

}  // namespace stillmap
