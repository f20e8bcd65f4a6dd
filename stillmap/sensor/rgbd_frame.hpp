// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// One color image with registered depth, rectified to an ideal pinhole camera. Immutable after
/// creation; passed as shared_ptr<const RgbdFrame>.
struct RgbdFrame {
  std::size_t index = 0;   ///< Index in source order 0, 1, 2, ..., without skipped frames.
  double timestamp = 0;    ///< Time of the color image [s].
  double depth_delay = 0;  ///< Time of the depth image minus that of the color image [s].
  cv::Mat color;           ///< Color image, 8UC3 BGR; gray images are replicated to three channels.
  cv::Mat gray;            ///< Gray image, 8UC1.
  cv::Mat depth;  ///< Depth along the optical axis, 32FC1 [m]; 0: unknown; all 0: no depth image.
  /// Whether depths were interpolated between those measured, as registration does.
  bool depth_interpolated = false;
  std::string name;  ///< File name of the color image without extension, or empty.
  /// Mask of the ignored pixels (Camera::ignore), 8UC1: where it is not 0, the depth is 0 and there
  /// are no keypoints. Empty: all pixels are used.
  cv::Mat ignored;
  /// Samples of the camera's IMU by increasing time: those of the last second, up to the first one
  /// after the frame. Empty: there are none.
  std::vector<ImuSample> imu;
  /// Samples of the robot's odometry of the same time.
  std::vector<OdometrySample> odometry;
};

using RgbdFramePtr = std::shared_ptr<const RgbdFrame>;

}  // namespace stillmap
