// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/depth_sensor.hpp"

#include <algorithm>

namespace stillmap {

/// 1 / sigma^2 of a depth, in units of that at one meter. Every depth of an ideal sensor weighs 1.
class DepthWeight {
 public:
  explicit DepthWeight(const DepthSensor& sensor)
      : ratio_(sensor.sigma(1) > 0 ? sensor.tolerance<float>(1 / sensor.sigma(1), 0)
                                   : DepthPolynomial<float>{.constant = 1}) {}

  float at(float z) const {
    constexpr float kNearest = 0.5F;  // nearer, the error is that of the pose [m]
    const float ratio = ratio_.at(std::max(z, kNearest));
    return 1 / (ratio * ratio);
  }

 private:
  DepthPolynomial<float> ratio_;  // sigma(z) / sigma(1 m)
};

}  // namespace stillmap
