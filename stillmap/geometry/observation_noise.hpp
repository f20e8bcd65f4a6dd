// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <algorithm>

namespace stillmap {

/// Standard deviations of a keypoint's measurement.
struct ObservationNoise {
  /// Of u and of v at pyramid level 0 [pixels]; it grows with the scale of the level.
  double pixel_sigma = 1.0;
  /// Of the disparity bf / depth at every level [pixels], where the sensor itself is better: depth
  /// and color images do not lie exactly on each other. The noise of a Kinect v1 alone is 0.06.
  double disparity_sigma = 0.3;
};

/// Noise of a keypoint with this depth [m] in images of this camera. The disparity's part is that
/// of the depth sensor, bf sigma(z) / z^2, or of the registration, whichever is larger.
inline ObservationNoise observation_noise(const Camera& camera, double depth) {
  ObservationNoise noise;
  if (depth > 0) {
    const double sensor = camera.bf() * camera.depth_sensor.sigma(depth) / (depth * depth);
    noise.disparity_sigma = std::max(noise.disparity_sigma, sensor);
  }
  return noise;
}

}  // namespace stillmap
