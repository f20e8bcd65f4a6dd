// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>

#include <opencv2/core.hpp>

namespace stillmap {

/// Makes frames of images as OpenCV users have them; those of a distorted camera are rectified.
class FrameMaker {
 public:
  /// @param recorded  the camera of the images; depths outside the range of its sensor are unknown
  /// Throws Error if the values are no camera's.
  explicit FrameMaker(const Camera& recorded);

  /// Returns the ideal pinhole of the frames.
  const Camera& camera() const { return rectifier_.camera(); }

  /// @param color     8-bit BGR or gray, of the camera's size
  /// @param depth     16-bit in units of 1 / depth_factor meters, or 32-bit float in meters; 0, and
  ///                  not-a-number, where unknown
  /// @param timestamp of the color image [s]
  /// Throws Error that names the argument, and its type or size, if it is wrong.
  RgbdFramePtr make(const cv::Mat& color, const cv::Mat& depth, double timestamp,
                    std::size_t index) const;

 private:
  cv::Mat meters_of(const cv::Mat& depth) const;

  Rectifier rectifier_;
};

}  // namespace stillmap
