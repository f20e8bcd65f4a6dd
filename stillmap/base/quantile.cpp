// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace stillmap {

double quantile(std::span<const double> values, double q) {
  if (values.empty()) return 0;
  std::vector<double> parted(values.begin(), values.end());
  const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(parted.size() - 1);
  const double below = std::floor(position);
  const auto nth = parted.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(parted.begin(), nth, parted.end());
  if (position == below) return *nth;
  const double next = *std::min_element(nth + 1, parted.end());
  return std::lerp(*nth, next, position - below);
}

}  // namespace stillmap
