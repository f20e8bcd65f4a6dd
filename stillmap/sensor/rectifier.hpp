// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/recording/camera_model.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Rectifies images of a distorted camera to those of an ideal pinhole camera with the same size,
/// focal lengths and principal point (radial-tangential model: Brown 1966; as OpenCV's
/// initUndistortRectifyMap). Images of a camera without distortion are returned without a copy.
class Rectifier {
 public:
  explicit Rectifier(const Camera& recorded);
  /// @param lens  distortion of the recorded images; that of `recorded` is not used
  Rectifier(const Camera& recorded, const LensDistortion& lens);

  /// Returns the ideal pinhole camera: the recorded camera without distortion and without an error
  /// of the depth.
  const Camera& camera() const { return camera_; }
  bool active() const { return !nearest_map_.empty(); }

  /// Rectifies color or gray images with bilinear interpolation. Pixels outside the recorded image
  /// repeat its border, so that no edge appears there.
  cv::Mat image(const cv::Mat& recorded) const;
  /// Rectifies depth, masks and labels of any type by nearest neighbor, so that no values are
  /// invented; 0 outside the recorded image.
  cv::Mat nearest(const cv::Mat& recorded) const;

 private:
  void check(const cv::Mat& recorded) const;

  Camera camera_;
  cv::Mat whole_map_,
      fraction_map_;     // bilinear: 16SC2 pixel and index into OpenCV's table of weights
  cv::Mat nearest_map_;  // 16SC2, rounded
};

}  // namespace stillmap
