// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/class_sets.hpp"

#include <algorithm>

namespace stillmap {
namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

ClassRole ClassSets::role_of(const std::string& class_name) const {
  if (contains(dynamic, class_name)) return ClassRole::kDynamic;
  if (contains(potential, class_name)) return ClassRole::kPotential;
  return ClassRole::kUnlisted;
}

ClassSets people_classes() { return {.dynamic = {"person", "unknown"}, .potential = {}}; }

ClassSets indoor_classes() {
  return {.dynamic = {"person", "unknown", "bird",  "cat",     "dog",        "horse",   "sheep",
                      "cow",    "bear",    "zebra", "giraffe", "elephant",   "bicycle", "car",
                      "bus",    "train",   "truck", "boat",    "motorcycle", "airplane"},
          .potential = {"chair",     "book",          "backpack",     "umbrella",
                        "handbag",   "suitcase",      "bottle",       "wine glass",
                        "cup",       "bowl",          "laptop",       "mouse",
                        "keyboard",  "remote",        "cell phone",   "skateboard",
                        "frisbee",   "sports ball",   "teddy bear",   "scissors",
                        "vase",      "hair drier",    "tie",          "skis",
                        "snowboard", "kite",          "baseball bat", "baseball glove",
                        "surfboard", "tennis racket", "fork",         "knife",
                        "spoon",     "banana",        "apple",        "sandwich",
                        "orange",    "broccoli",      "carrot",       "hot dog",
                        "pizza",     "donut",         "cake",         "toothbrush"}};
}

std::vector<cv::Rect> boxes_with_role(const SegmentedFramePtr& frame, const ClassSets& classes,
                                      ClassRole role) {
  std::vector<cv::Rect> boxes;
  if (!frame) return boxes;
  for (const Instance& instance : frame->instances) {
    if (classes.role_of(instance.class_name) == role) boxes.push_back(instance.box);
  }
  return boxes;
}

bool in_any_box(const std::vector<cv::Rect>& boxes, float u, float v) {
  const cv::Point pixel(cvRound(u), cvRound(v));
  return std::any_of(boxes.begin(), boxes.end(),
                     [&](const cv::Rect& box) { return box.contains(pixel); });
}

void mark_moving(const cv::Rect& box, cv::Size image, MotionEvidence& evidence) {
  const cv::Rect visible = box & cv::Rect(cv::Point(), image);
  if (visible.empty()) return;
  if (evidence.moving_pixels.empty()) evidence.moving_pixels = cv::Mat::zeros(image, CV_8UC1);
  evidence.moving_pixels(visible).setTo(255);
}

}  // namespace stillmap
