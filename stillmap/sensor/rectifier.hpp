// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Turns what a distorted camera recorded into what an ideal pinhole with the same size, focal
/// lengths and principal point would have seen (radial-tangential model: Brown 1966; as OpenCV's
/// initUndistortRectifyMap). For cameras without distortion everything is handed through uncopied.
class Rectifier {
 public:
  explicit Rectifier(const Camera& recorded);

  /// The ideal pinhole: the recorded camera without distortion.
  const Camera& camera() const { return camera_; }
  bool active() const { return !nearest_map_.empty(); }

  /// Color or gray, bilinear. Pixels that the camera did not record repeat its border, so that no
  /// edge appears there.
  cv::Mat image(const cv::Mat& recorded) const;
  /// Depth, masks and labels of any type: the nearest recorded value, none invented; 0 where
  /// nothing was recorded.
  cv::Mat nearest(const cv::Mat& recorded) const;

 private:
  void check(const cv::Mat& recorded) const;

  Camera camera_;
  cv::Mat whole_map_,
      fraction_map_;     // bilinear: 16SC2 pixel and index into OpenCV's table of weights
  cv::Mat nearest_map_;  // 16SC2, rounded
};

}  // namespace stillmap
