// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/stamp_unit.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace stillmap {

double unit_of_stamps(std::span<const double> stamps) {
  constexpr double kYear2001 = 1e9, kYear2100 = 4.1e9, kLongestInterval = 60;  // s
  std::vector<double> sorted;
  std::copy_if(stamps.begin(), stamps.end(), std::back_inserter(sorted),
               [](double stamp) { return std::isfinite(stamp); });
  if (sorted.empty()) return 1;
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> intervals;
  for (std::size_t i = 1; i < sorted.size(); ++i) intervals.push_back(sorted[i] - sorted[i - 1]);
  const double first = sorted.front(), interval = quantile(intervals, 0.5);
  for (const double unit : {1e-3, 1e-6, 1e-9}) {
    const bool of_our_time = first * unit > kYear2001 && first * unit < kYear2100;
    if (of_our_time && interval * unit <= kLongestInterval) return unit;
  }
  return 1;
}

}  // namespace stillmap
