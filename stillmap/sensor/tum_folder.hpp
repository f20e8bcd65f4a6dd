// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace stillmap {

struct TumFolderOptions {
  int first = 0;   ///< Number of pairs skipped at the start.
  int count = 0;   ///< Maximum number of pairs, counted before the stride; 0: all.
  int stride = 1;  ///< Every n-th pair is used.
};

/// A recorded sequence in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012).
class TumFolder : public FrameSource {
 public:
  /// @param camera  the recording camera; frames are rectified if it is distorted
  /// Throws Error for invalid lists (see list_frames()), options out of range, and if no frame is
  /// usable (all images missing, of the wrong type, or not of the camera's size).
  TumFolder(const SequencePaths& paths, const Camera& camera, const TumFolderOptions& options = {});

  const Camera& camera() const override { return rectifier_.camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return list_.frames.size() - position_; }
  const std::vector<SkippedFrame>& skipped() const override { return list_.skipped; }
  const Rectifier& rectifier() const { return rectifier_; }
  /// Returns the selected frames, usable or not, in order.
  const std::vector<FrameFiles>& frames() const { return list_.frames; }

 private:
  void choose_range();
  void require_one_usable_frame() const;
  RgbdFramePtr load(const FrameFiles& files);
  cv::Mat load_depth(const FrameFiles& files);

  TumFolderOptions options_;
  Rectifier rectifier_;
  DisparityBias disparity_bias_;
  FrameList list_;
  std::size_t position_ = 0;    // index of the next pair in list_.frames
  std::size_t next_index_ = 0;  // index of the next returned frame
};

/// Converts raw 16-bit depth to 32FC1 [m]; 0 (unknown) for raw 0, saturated readings (65535), and
/// depths outside the sensor's range.
cv::Mat depth_in_meters(const cv::Mat& raw, double depth_factor, const DepthSensor& sensor);

/// Removes the systematic error of the disparity from a rectified depth image, 32FC1 [m]: z = 1 /
/// (1 / measured - error). Depths that leave the range of the camera's sensor become unknown.
void correct_disparity(const DisparityBias& bias, const Camera& camera, cv::Mat& depth);

}  // namespace stillmap
