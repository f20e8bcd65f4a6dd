// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/increasing.hpp"

#include <algorithm>

namespace stillmap {

std::vector<bool> longest_increasing(const std::vector<double>& stamps) {
  constexpr auto kNone = static_cast<std::size_t>(-1);
  // tails[k]: the smallest last timestamp of an increasing subsequence of k + 1
  std::vector<std::size_t> tails;
  std::vector<std::size_t> before(stamps.size(), kNone);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto at =
        std::lower_bound(tails.begin(), tails.end(), stamps[i],
                         [&](std::size_t tail, double stamp) { return stamps[tail] < stamp; });
    if (at != tails.begin()) before[i] = *(at - 1);
    if (at == tails.end()) {
      tails.push_back(i);
    } else if (stamps[i] < stamps[*at]) {
      *at = i;
    }
  }
  std::vector<bool> kept(stamps.size());
  for (std::size_t i = tails.empty() ? kNone : tails.back(); i != kNone; i = before[i])
    kept[i] = true;
  return kept;
}

}  // namespace stillmap
