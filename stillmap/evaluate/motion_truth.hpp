// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/stamped_images.hpp"

#include <filesystem>
#include <optional>

#include <opencv2/core.hpp>

namespace stillmap {

/// Ground truth of motion in one frame. All images are height x width.
struct MotionTruth {
  /// Mask of the movable objects, 8UC1: 255 person, 128 object of unknown class, 0 static.
  cv::Mat mask;
  /// Number of the mover at each pixel, 8UC1: 1 to 255; 0 static. If the image is empty, each
  /// connected piece of the mask counts as one mover.
  cv::Mat instances;
  /// Speed of the visible surface in the world, 32FC1 [m/s]. If the image is empty, every movable
  /// object counts as moving.
  cv::Mat speed;
};

/// Speed of one gray level of a speed image [m/s]; level 255 means 1.275 m/s or more.
constexpr double kSpeedUnit = 0.005;
/// Converts speeds in meters per second (32FC1) to gray levels (8UC1).
cv::Mat speed_image(const cv::Mat& meters_per_second);
/// Converts gray levels (8UC1) to speeds in meters per second (32FC1).
cv::Mat meters_per_second(const cv::Mat& speed_image);

/// Ground truth of motion in the folder of a sequence in TUM layout, as 8-bit PNGs named by
/// timestamp: mask/, and optionally instance/ and speed/, which are simulated or measured.
class MotionTruthFolder {
 public:
  /// @param speed_folder used instead of the sequence's own speed/; may be empty
  /// Throws Error if there is no mask/, or a folder contains no images.
  explicit MotionTruthFolder(const std::filesystem::path& sequence,
                             const std::filesystem::path& speed_folder = {});
  bool knows_speed() const { return speeds_.has_value(); }
  /// Returns the ground truth of the frame nearest in time [s]; none if the frame has no mask, or
  /// if other frames have speeds and this one has none. Throws Error for an unreadable image, and
  /// for images of different sizes.
  std::optional<MotionTruth> at(double timestamp) const;

 private:
  StampedImages masks_;
  std::optional<StampedImages> instances_, speeds_;
};

}  // namespace stillmap
