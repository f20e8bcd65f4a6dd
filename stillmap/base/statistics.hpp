// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace stillmap {

/// Returns the value of a rank in ascending order, 0 for the smallest. Reorders the values. Linear
/// time.
/// @param rank less than the number of values
template <typename T>
T value_of_rank(std::vector<T>& values, std::size_t rank) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Returns the median, for an even number of values the larger of the two in the middle. Reorders
/// the values.
/// @param values at least one
template <typename T>
T upper_median(std::vector<T>& values) {
  return value_of_rank(values, values.size() / 2);
}

/// Returns the q-quantile [0..1] of values in any order, interpolated linearly between the two
/// nearest, or 0 of none. Linear time.
inline double quantile(std::span<const double> values, double q) {
  if (values.empty()) return 0;
  std::vector<double> ordered(values.begin(), values.end());
  const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(ordered.size() - 1);
  const double below = std::floor(position);
  const double value = value_of_rank(ordered, static_cast<std::size_t>(below));
  if (position == below) return value;
  const auto above = ordered.begin() + static_cast<std::ptrdiff_t>(below) + 1;
  return std::lerp(value, *std::min_element(above, ordered.end()), position - below);
}

}  // namespace stillmap
