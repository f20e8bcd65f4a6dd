// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/draw_frame.hpp"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

const cv::Scalar kMoving(60, 60, 235), kAgreeing(90, 220, 70), kOther(60, 210, 240),
    kText(255, 255, 255);

void tint_moving(cv::Mat& picture, const cv::Mat& moving) {
  if (moving.empty()) return;
  cv::Mat red(picture.size(), picture.type(), kMoving), mixed;
  cv::addWeighted(picture, 0.6, red, 0.4, 0, mixed);
  mixed.copyTo(picture, moving);
}

void outline_instances(cv::Mat& picture, const SegmentedFrame& segmented) {
  for (const Instance& instance : segmented.instances) {
    if (!instance.mask.empty()) {
      std::vector<std::vector<cv::Point>> contours;
      cv::findContours(instance.mask.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE,
                       instance.box.tl());
      cv::drawContours(picture, contours, -1, kText, 1, cv::LINE_AA);
    }
    const std::string label = fmt::format("{} {:.2f}", instance.class_name, instance.confidence);
    const cv::Point at(instance.box.x + 3, instance.box.y + 14);
    cv::putText(picture, label, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, cv::Scalar(0, 0, 0), 3,
                cv::LINE_AA);
    cv::putText(picture, label, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, kText, 1, cv::LINE_AA);
  }
}

void draw_keypoints(cv::Mat& picture, const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    const cv::Point2f at(k.u, k.v);
    if (frame.evidence.weight[i] <= 0) {
      cv::drawMarker(picture, at, kMoving, cv::MARKER_TILTED_CROSS, 6, 1, cv::LINE_AA);
    } else if (tracked.landmarks[i].valid()) {
      cv::circle(picture, at, 3, kAgreeing, 1, cv::LINE_AA);
    } else {
      cv::circle(picture, at, 1, kOther, 1, cv::LINE_AA);
    }
  }
}

}  // namespace

cv::Mat draw_frame(const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  cv::Mat picture = frame.image->color.clone();
  tint_moving(picture, frame.evidence.moving_pixels);
  if (frame.instances) outline_instances(picture, *frame.instances);
  draw_keypoints(picture, tracked);
  return picture;
}

}  // namespace stillmap
