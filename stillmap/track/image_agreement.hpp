// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <optional>
#include <vector>

namespace stillmap {

/// Compares motions of the camera between two frames by how much of the image they explain: unlike
/// keypoints, which are many on a patterned shirt and few on a wall, all parts of the image count
/// alike.
class ImageAgreement {
 public:
  ImageAgreement(const Camera& camera, const RgbdFrame& first, const RgbdFrame& frame);

  /// Returns the mean agreement [0..1] of depth and brightness of the frame's surfaces with what
  /// the first frame shows where they lie: 1 / (1 + r^2) for each residual r over its scale.
  /// Surfaces outside of the first frame, or where that has no depth, do not count.
  double of(const Pose& T_first_frame) const;

  /// Returns the motion near a guess that agrees best, by iteratively reweighted least squares on
  /// both residuals (Kerl, Sturm, Cremers, Dense visual SLAM for RGB-D cameras, IROS 2013).
  Pose refined(const Pose& T_first_frame) const;

  /// Returns whether the first frame has a surface at a point in its camera frame [m].
  bool shows(const Eigen::Vector3d& p_first) const;

 private:
  /// The pixel of a block of the frame at which the brightness changes most.
  struct Surface {
    Eigen::Vector3d p_frame;  // [m]
    double brightness;        // [gray levels]
  };
  /// A surface of the frame where the first frame shows it.
  struct Comparison {
    Eigen::Vector3d p_first;   // [m]
    cv::Point pixel;           // of the first frame
    double scale;              // of the depth [m]
    double depth, brightness;  // residuals over their scales
  };
  std::vector<Surface> surfaces_of(const RgbdFrame& frame) const;
  std::optional<Comparison> compared(const Surface& surface, const Pose& T_first_frame) const;
  std::vector<Comparison> compared(const Pose& T_first_frame) const;
  bool is_smooth(const Comparison& c) const;

  Camera camera_;
  DepthPolynomial<double> scale_;  // of a difference of depths [m]
  cv::Mat1f brightness_, depth_;   // of the first frame
  std::vector<Surface> surfaces_;  // of the other
};

}  // namespace stillmap
