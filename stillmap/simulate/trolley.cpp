// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/trolley.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace stillmap {

Eigen::Vector3d Trolley::at(double seconds) const {
  const Eigen::Vector3d along(bridge, 0, 0), across(0, rails, 0);
  const std::array<Eigen::Vector3d, 4> sides{along, across, -along, -across};
  Eigen::Vector3d position = start;
  double left = seconds;
  for (const Eigen::Vector3d& side : sides) {
    const double duration = side.norm() / speed;
    const double share = std::clamp(left / duration, 0.0, 1.0);
    // The speed rises from zero and falls back to it like a sine.
    position += (1 - std::cos(std::numbers::pi * share)) / 2 * side;
    left -= duration;
  }
  return position;
}

double Trolley::round() const { return 2 * (std::abs(bridge) + std::abs(rails)) / speed; }

}  // namespace stillmap
