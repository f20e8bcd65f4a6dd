// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/motion/cell_grid.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Images of a frame as a camera would record them that exposes all rows of color and depth at the
/// timestamp: the counterpart of MotionCompensation for whole images. Each pixel is the recorded
/// one that shows its point. Where the camera moves by less than half a pixel, images stay as they
/// are.
class GlobalShutter {
 public:
  /// @param motion with the delay of the depth image, that of its timestamp included
  /// The frame and the camera must outlive this object.
  GlobalShutter(const RgbdFrame& recorded, const Camera& camera, const ExposureMotion& motion);

  /// Returns whether the images change at all.
  bool has_effect() const { return !color_source_.empty(); }
  /// Returns color and depth [m], without gray image and ignored pixels; pixels that the recorded
  /// depth image does not show have no depth.
  RgbdFrame frame() const;
  /// Returns a mask of the recorded color image in the pixels of frame(); empty if it is empty.
  cv::Mat1b mask(const cv::Mat1b& recorded) const;

 private:
  cv::Mat2f sources(double delay) const;
  cv::Mat1f depth() const;

  const RgbdFrame& recorded_;
  const Camera& camera_;
  ExposureMotion motion_;
  cv::Mat2f color_source_, depth_source_;  // recorded pixel of each; empty without effect
};

}  // namespace stillmap
