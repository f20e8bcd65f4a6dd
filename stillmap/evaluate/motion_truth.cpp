// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/motion_truth.hpp"

#include "stillmap/base/error.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

StampedImages masks_of(const fs::path& sequence) {
  if (!fs::is_directory(sequence / "mask")) {
    throw Error("has no mask/ folder", sequence.string(),
                "name a sequence with true masks, which the evaluation of labels needs");
  }
  return StampedImages(sequence / "mask");
}

std::optional<StampedImages> images_in(const fs::path& folder) {
  return fs::is_directory(folder) ? std::optional(StampedImages(folder)) : std::nullopt;
}

void require_size(const cv::Mat& image, const cv::Mat& mask, const char* kind, double timestamp) {
  if (image.size() == mask.size()) return;
  throw Error(fmt::format("the {} image is {} x {}, the mask {} x {} pixels", kind, image.cols,
                          image.rows, mask.cols, mask.rows),
              fmt::format("frame {:.6f}", timestamp), "use the ground truth of one sequence");
}

}  // namespace

cv::Mat speed_image(const cv::Mat& meters_per_second) {
  cv::Mat image;
  meters_per_second.convertTo(image, CV_8UC1, 1 / kSpeedUnit);  // rounds and saturates
  return image;
}

cv::Mat meters_per_second(const cv::Mat& speed_image) {
  cv::Mat speed;
  speed_image.convertTo(speed, CV_32FC1, kSpeedUnit);
  return speed;
}

MotionTruthFolder::MotionTruthFolder(const fs::path& sequence, const fs::path& speed_folder)
    : masks_(masks_of(sequence)),
      instances_(images_in(sequence / "instance")),
      speeds_(speed_folder.empty() ? images_in(sequence / "speed")
                                   : std::optional(StampedImages(speed_folder))) {}

std::optional<MotionTruth> MotionTruthFolder::at(double timestamp) const {
  MotionTruth truth;
  truth.mask = masks_.at(timestamp);
  if (truth.mask.empty()) return std::nullopt;
  if (instances_) truth.instances = instances_->at(timestamp);
  if (!truth.instances.empty()) require_size(truth.instances, truth.mask, "instance", timestamp);
  if (!speeds_) return truth;
  const cv::Mat levels = speeds_->at(timestamp);
  if (levels.empty()) return std::nullopt;
  require_size(levels, truth.mask, "speed", timestamp);
  truth.speed = meters_per_second(levels);
  return truth;
}

}  // namespace stillmap
