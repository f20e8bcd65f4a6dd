// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <algorithm>

namespace stillmap {

/// Standard deviations of a keypoint's measurement.
struct ObservationNoise {
  /// Standard deviation of u and v at pyramid level 0 [pixels]; it grows with the level's scale.
  double pixel_sigma = 1.0;
  double disparity_sigma = 0.3;  ///< Standard deviation of the disparity bf / depth [pixels].
};

/// Returns the noise of a keypoint with this depth [m] in images of this camera. The disparity
/// noise is that of the depth sensor, bf sigma(z) / z^2, or of the registration if that is larger.
inline ObservationNoise observation_noise(const Camera& camera, double depth) {
  ObservationNoise noise;
  noise.disparity_sigma = camera.disparity_sigma;
  if (depth > 0) {
    const double sensor = camera.bf() * camera.depth_sensor.sigma(depth) / (depth * depth);
    noise.disparity_sigma = std::max(noise.disparity_sigma, sensor);
  }
  return noise;
}

}  // namespace stillmap
