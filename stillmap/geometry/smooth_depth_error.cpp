// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/smooth_depth_error.hpp"

#include <algorithm>

namespace stillmap {

SmoothDepthError::Weights SmoothDepthError::weights_at(double u, double v,
                                                       const Eigen::Vector2d& size) {
  const double x = std::clamp(u / (size.x() - 1), 0.0, 1.0) * (kCols - 1);
  const double y = std::clamp(v / (size.y() - 1), 0.0, 1.0) * (kRows - 1);
  const int c = std::min(static_cast<int>(x), kCols - 2);
  const int r = std::min(static_cast<int>(y), kRows - 2);
  const double right = x - c, down = y - r;
  const int first = r * kCols + c;
  return {{first, first + 1, first + kCols, first + kCols + 1},
          {(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right}};
}

double SmoothDepthError::at(double u, double v, const Eigen::Vector2d& size) const {
  const Weights weights = weights_at(u, v, size);
  double error = 0;
  for (std::size_t i = 0; i < 4; ++i) error += weights.weight[i] * nodes_[weights.node[i]];
  return error;
}

double SmoothDepthError::removed_from(double depth, double u, double v,
                                      const Eigen::Vector2d& size) const {
  return 1 / std::max(1 / depth - at(u, v, size), 0.5 / depth);
}

}  // namespace stillmap
