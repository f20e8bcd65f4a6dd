// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/trace.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <memory>

#include <opencv2/imgproc.hpp>

namespace stillmap {

/// Returns a frame with rectified images; its index is not set.
/// @param recorded_color as recorded, 8-bit BGR
/// @param depth          rectified, 32FC1 [m]; empty: the frame has depth 0 everywhere. Set to 0
///                       where pixels are ignored
/// @param timestamp      of the color image [s]
/// @param depth_delay    exposure of the depth image after that of the color image [s]
inline std::shared_ptr<RgbdFrame> rectified_frame(const Rectifier& rectifier,
                                                  const cv::Mat& recorded_color,
                                                  const cv::Mat& depth, double timestamp,
                                                  double depth_delay) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->timestamp = timestamp;
  frame->color = rectifier.image(recorded_color);
  traced("gray", [&] { cv::cvtColor(frame->color, frame->gray, cv::COLOR_BGR2GRAY); });
  const bool has_depth = !depth.empty();
  frame->depth = has_depth ? depth : cv::Mat(cv::Mat::zeros(frame->color.size(), CV_32FC1));
  frame->depth_delay = has_depth ? depth_delay : 0;
  frame->ignored = rectifier.ignored();
  if (!frame->ignored.empty()) frame->depth.setTo(0, frame->ignored);
  return frame;
}

}  // namespace stillmap
