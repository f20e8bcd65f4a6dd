// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/camera_model.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Registers depth images to the color camera: each reading is moved to the color pixel that shows
/// the same point, and becomes its depth in the color camera.
///
/// Where several readings reach a pixel, the nearest remains. Between readings that are more than
/// one color pixel apart, and where a background shows through such a gap, a pixel whose two
/// neighbors in a row or column lie on one surface in front of it takes the depth between them.
class DepthRegistration {
 public:
  /// @param depth          camera of the depth images, with its distortion
  /// @param T_color_depth  pose of the depth camera in the frame of the color camera
  /// @param color          ideal pinhole camera of the rectified color images
  DepthRegistration(const RecordedCamera& depth, const Pose& T_color_depth, const Camera& color);

  /// Returns the registered image, 32FC1 [m] of the size of the color images; 0: unknown.
  /// @param depth  32FC1 [m] of the size of the depth images; 0: unknown
  /// Throws Error if the image has another size.
  cv::Mat operator()(const cv::Mat& depth) const;

 private:
  int width_, height_;             // of the color images [pixels]
  int block_ = 1;                  // width and height of the square that a reading covers [pixels]
  Eigen::Vector3f offset_;         // K_color * t_color_depth
  cv::Mat ray_x_, ray_y_, ray_z_;  // K_color * R_color_depth * (x, y, 1) of each depth pixel, 32FC1
};

}  // namespace stillmap
