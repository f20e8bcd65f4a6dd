// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"
#include "stillmap/sensor/stereo_matcher.hpp"

#include <cstddef>
#include <optional>

#include <opencv2/core.hpp>

namespace stillmap {

/// Makes frames of OpenCV images; those of a distorted camera are rectified.
class FrameMaker {
 public:
  /// @param recorded  camera of the images; depths outside the range of its sensor become unknown
  /// Throws Error if its values are impossible.
  explicit FrameMaker(const Camera& recorded);

  /// Returns the ideal pinhole of the frames.
  const Camera& camera() const { return rectifier_.camera(); }

  /// Returns a frame made of a color and a depth image.
  /// @param color     8-bit BGR or gray, of the camera's size
  /// @param depth     16-bit in units of 1 / depth_factor meters, or 32-bit float in meters; 0 or
  ///                  NaN where the depth is unknown
  /// @param timestamp time of the color image [s]
  /// Throws Error that names the argument, and its type or size, if it is wrong; also if the known
  /// depths are so large that their unit must be wrong.
  RgbdFramePtr make(const cv::Mat& color, const cv::Mat& depth, double timestamp,
                    std::size_t index) const;

  /// Returns a frame made of a rectified stereo pair, with depth by StereoMatcher.
  /// @param left, right  8-bit BGR or gray, of the camera's size
  /// Throws Error as make(), for a camera that is distorted or whose depth sensor is not "stereo",
  /// and as StereoMatcher::check_order().
  RgbdFramePtr make_of_pair(const cv::Mat& left, const cv::Mat& right, double timestamp,
                            std::size_t index);

 private:
  cv::Mat meters_of(const cv::Mat& depth) const;

  Rectifier rectifier_;
  DisparityBias disparity_bias_;
  std::optional<StereoMatcher> matcher_;  // none before the first pair
};

}  // namespace stillmap
