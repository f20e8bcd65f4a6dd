// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/stamped_images.hpp"

#include <filesystem>
#include <optional>

#include <opencv2/core.hpp>

namespace stillmap {

/// What truly moves in one frame. All images height x width.
struct MotionTruth {
  cv::Mat mask;  ///< 8UC1: what can move: 255 person, 128 thing of no known class, 0 static
  /// 8UC1: which mover, 1 to 255; 0 static. Empty: not known; each connected piece of the mask then
  /// counts as one mover.
  cv::Mat instances;
  /// 32FC1 m/s: how fast the surface seen moves through the world. Empty: not known; all that can
  /// move then does.
  cv::Mat speed;
};

/// A gray level of a speed image stands for so many m/s; 255 for 1.275 m/s and more.
constexpr double kSpeedUnit = 0.005;
/// Between meters per second (32FC1) and gray levels (8UC1).
cv::Mat speed_image(const cv::Mat& meters_per_second);
cv::Mat meters_per_second(const cv::Mat& speed_image);

/// The truth that lies beside a sequence in TUM layout, as 8-bit PNGs named by stamps: mask/, and,
/// where `stillmap simulate` wrote them or they were measured, instance/ and speed/.
class MotionTruthFolder {
 public:
  /// @param speed_folder used instead of the sequence's own speed/; may be empty
  /// Throws Error where there is no mask/, or a folder contains no images.
  explicit MotionTruthFolder(const std::filesystem::path& sequence,
                             const std::filesystem::path& speed_folder = {});
  bool knows_speed() const { return speeds_.has_value(); }
  /// None where the frame has no mask, or speeds are known but not this one's. Throws Error for a
  /// broken image, and for images that differ in size.
  std::optional<MotionTruth> at(double timestamp) const;

 private:
  StampedImages masks_;
  std::optional<StampedImages> instances_, speeds_;
};

}  // namespace stillmap
