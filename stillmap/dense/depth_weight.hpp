// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/depth_sensor.hpp"

#include <algorithm>

namespace stillmap {

/// Weight 1 / sigma^2 of a depth relative to that at one meter; 1 for every depth of an ideal
/// sensor.
class DepthWeight {
 public:
  explicit DepthWeight(const DepthSensor& sensor)
      : ratio_(sensor.sigma(1) > 0 ? sensor.tolerance<float>(1 / sensor.sigma(1), 0)
                                   : DepthPolynomial<float>{.constant = 1}) {}

  float at(float z) const {
    constexpr float kNearest = 0.5F;  // Nearer, the error of the pose dominates [m].
    const float ratio = ratio_.at(std::max(z, kNearest));
    return 1 / (ratio * ratio);
  }

 private:
  DepthPolynomial<float> ratio_;  // sigma(z) / sigma(1 m)
};

}  // namespace stillmap
