// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/frame_image.hpp"

#include "stillmap/report/image_marks.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

void tint_moving(cv::Mat& image, const cv::Mat& moving) {
  if (moving.empty()) return;
  cv::Mat red(image.size(), image.type(), kMovingColor), mixed;
  cv::addWeighted(image, 0.6, red, 0.4, 0, mixed);
  mixed.copyTo(image, moving);
}

/// Writes a label at a position or, where other labels are, below; not at all if there is no place.
void write_apart(cv::Mat& image, const std::string& label, cv::Point at,
                 std::vector<cv::Rect>& taken) {
  const auto area = [&] { return line_area(image.size(), label, at); };
  const auto overlaps = [&](const cv::Rect& other) { return !(other & area()).empty(); };
  while (std::any_of(taken.begin(), taken.end(), overlaps)) at.y += area().height;
  if (area().br().y > image.rows) return;
  write_line(image, label, at);
  taken.push_back(area());
}

void outline_instances(cv::Mat& image, const SegmentedFrame& segmented) {
  std::vector<cv::Rect> taken;
  for (const Instance& instance : segmented.instances) {
    if (!instance.mask.empty()) {
      std::vector<std::vector<cv::Point>> contours;
      cv::findContours(instance.mask.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE,
                       instance.box.tl());
      cv::drawContours(image, contours, -1, cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
    }
    const std::string label =
        fmt::format("{} {:.0f} %", instance.class_name, 100 * instance.confidence);
    write_apart(image, label, {instance.box.x + 3, instance.box.y + 14}, taken);
  }
}

void draw_keypoints(cv::Mat& image, const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    const cv::Point2f at(k.u, k.v);
    if (frame.evidence.weight[i] <= 0) {
      cv::drawMarker(image, at, kMovingColor, cv::MARKER_TILTED_CROSS, 6, 1, cv::LINE_AA);
    } else if (tracked.landmarks[i].valid()) {
      cv::circle(image, at, 3, kAgreeingColor, 1, cv::LINE_AA);
    } else {
      cv::circle(image, at, 1, kOtherColor, 1, cv::LINE_AA);
    }
  }
}

/// Returns a color between red (0), yellow (0.5) and green (1).
cv::Scalar probability_color(float p) {
  const double red = std::min(1.0F, 2 - 2 * p), green = std::min(1.0F, 2 * p);
  return {40, 40 + 190 * green, 40 + 200 * red};
}

void draw_motion_labels(cv::Mat& image, const Frame& frame) {
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    const cv::Point2f at(k.u, k.v);
    if (frame.evidence.weight[i] <= 0) {
      cv::drawMarker(image, at, kMovingColor, cv::MARKER_TILTED_CROSS, 6, 1, cv::LINE_AA);
    } else {
      const float p = static_probability(frame.evidence.static_log_odds[i]);
      cv::circle(image, at, 2, probability_color(p), 1, cv::LINE_AA);
    }
  }
}

std::string label_line(const TrackedFrame& tracked) {
  const auto& weights = tracked.frame->evidence.weight;
  const auto moving = std::count(weights.begin(), weights.end(), 0.0F);
  return fmt::format("frame {}: {} of {} keypoints move, {} landmarks agree {}",
                     tracked.frame->index(), moving, weights.size(), tracked.inliers,
                     tracked.reason);
}

}  // namespace

cv::Mat draw_labels(const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  cv::Mat image = grayed(frame.image->color);
  tint_moving(image, frame.evidence.moving_pixels);
  if (frame.instances) outline_instances(image, *frame.instances);
  draw_motion_labels(image, frame);
  write_line(image, label_line(tracked), {6, image.rows - 8});
  return image;
}

cv::Mat draw_frame(const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  cv::Mat image = frame.image->color.clone();
  tint_moving(image, frame.evidence.moving_pixels);
  if (frame.instances) outline_instances(image, *frame.instances);
  draw_keypoints(image, tracked);
  return image;
}

}  // namespace stillmap
