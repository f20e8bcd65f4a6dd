// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"

#include <cstdint>

#include <opencv2/core.hpp>

namespace stillmap {

/// What a structured-light camera does to a perfect picture. Defaults: a Kinect v1.
struct KinectOptions {
  double axial = 1;      ///< factor on Nguyen's axial sigma; 0: no axial noise
  double lateral = 0.5;  ///< jitter of the place a depth is read at, sigma [px]
  double disparity_step =
      0.125;           ///< quantization [px] (Khoshelham and Elberink 2012, section 2.2); 0: none
  double focal = 580;  ///< of the infrared camera [px]
  double nearest = 0.45;  ///< shortest measured depth [m]
  double farthest = 7.5;  ///< longest measured depth [m]
  double grazing = 80;    ///< surfaces seen at a larger angle to their normal give no depth [deg]
  bool shadow =
      true;  ///< no depth where the projector, `Camera::baseline` to the right, does not reach
  double edge_loss = 0.4;    ///< share of pixels at depth jumps that give no depth
  double color_sigma = 1.5;  ///< noise of a black pixel [gray levels]
  double color_gain = 0.02;  ///< growth of its variance with the value (photon noise) [gray levels]
  double exposure_drift = 0.03;  ///< amplitude of the slow change of brightness, as a share
  STILLMAP_FIELDS(axial, lateral, disparity_step, focal, nearest, farthest, grazing, shadow,
                  edge_loss, color_sigma, color_gain, exposure_drift)
};

/// Axial noise sigma [m] of a Kinect at depth z [m]: Nguyen, Izadi and Lovell 2012, "Modeling
/// Kinect sensor noise for improved 3D reconstruction and tracking", equation 4 (below 60 degrees).
double kinect_sigma(double z);

/// Depth as the sensor measures it. The noise depends on `seed` and `frame` only.
/// @param depth 32FC1 meters, exact; 0 where nothing is
cv::Mat measure_depth(const cv::Mat& depth, const Camera& camera, const KinectOptions& options,
                      std::uint64_t seed, std::uint64_t frame);

/// Color as the sensor delivers it: 8UC3.
/// @param color 32FC3, 0..255
cv::Mat measure_color(const cv::Mat& color, double seconds, const KinectOptions& options,
                      std::uint64_t seed, std::uint64_t frame);

}  // namespace stillmap
