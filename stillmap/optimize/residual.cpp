// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/residual.hpp"

namespace stillmap {

Measurement make_measurement(const Camera& camera, const ObservationNoise& noise, double u,
                             double v, double depth, double scale) {
  Measurement m;
  if (!std::isfinite(u) || !std::isfinite(v) || !std::isfinite(scale) || scale <= 0) return m;
  const double sigma = noise.pixel_sigma * scale;
  m.uvd << u, v, 0;
  m.pixel_information = 1 / (sigma * sigma);
  if (std::isfinite(depth) && depth > 0) {
    m.uvd.z() = camera.bf() / depth;
    m.disparity_information = 1 / (noise.disparity_sigma * noise.disparity_sigma);
  }
  return m;
}

}  // namespace stillmap
