// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <cstdint>

#include <opencv2/core.hpp>

namespace stillmap {

/// Noise and exposure of the color camera of a simulated sensor.
struct ColorNoise {
  double sigma = 1.5;            ///< Noise of a black pixel [gray levels].
  double gain = 0.02;            ///< Growth of its variance with the value [gray levels].
  double exposure_drift = 0.03;  ///< Amplitude of the slow change of brightness, as a share.
  /// Strength of the automatic exposure: 0 keeps the brightness of the scene, 1 brings the mean of
  /// every image to 110 gray levels.
  double auto_exposure = 0;
};

/// Systematic error of the measured disparity, as poorly calibrated sensors have it: an offset over
/// the whole image and an offset that grows with the squared distance from the center (Teichman,
/// Miller, Thrun, Unsupervised intrinsic calibration of depth sensors via SLAM, RSS 2013). Positive
/// values make depth read short. No effect on sensors without baseline.
struct DepthBias {
  double offset = 0;  ///< Error in the whole image [pixels of the sensor's own disparity].
  double bow = 0;     ///< Additional error in the corners of the image [pixels of disparity].
};

/// Returns the depth that the camera's depth sensor measures: with axial and lateral noise,
/// quantization and limited range, and without depth on grazing surfaces, at some of the depth
/// edges, and on surfaces that a nearer one occludes for the projector or second camera,
/// `DepthSensor::baseline` to the right. An ideal sensor returns the exact depth. The noise depends
/// on `seed` and `frame` only.
/// @param depth exact depth, 32FC1 [m]; 0 without a surface
cv::Mat measure_depth(const cv::Mat& depth, const Camera& camera, std::uint64_t seed,
                      std::uint64_t frame, const DepthBias& bias = {});

/// Returns the color image of the sensor, 8UC3.
/// @param color 32FC3, 0..255
cv::Mat measure_color(const cv::Mat& color, double seconds, const ColorNoise& noise,
                      std::uint64_t seed, std::uint64_t frame);

}  // namespace stillmap
