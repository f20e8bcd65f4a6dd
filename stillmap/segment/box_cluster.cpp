// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/box_cluster.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace stillmap {

cv::Mat1b cluster_in_box(const cv::Mat1f& depth, const cv::Rect& box) {
  constexpr float kGap = 0.1F;  // [m]
  const cv::Rect center(box.x + box.width / 5, box.y + box.height / 5,
                        std::max(1, 3 * box.width / 5), std::max(1, 3 * box.height / 5));
  std::vector<float> depths;
  for (const float z : cv::Mat1f(depth(center))) {
    if (z > 0 && std::isfinite(z)) depths.push_back(z);
  }
  std::sort(depths.begin(), depths.end());
  std::size_t best_begin = 0, best_end = 0, begin = 0;
  for (std::size_t i = 1; i <= depths.size(); ++i) {
    if (i < depths.size() && depths[i] - depths[i - 1] < kGap) continue;
    if (i - begin > best_end - best_begin) best_begin = begin, best_end = i;
    begin = i;
  }
  if (best_end == 0) return cv::Mat1b::zeros(box.size());
  const cv::Mat1f inside = depth(box);
  return cv::Mat1b((inside >= depths[best_begin] - kGap) & (inside <= depths[best_end - 1] + kGap));
}

}  // namespace stillmap
