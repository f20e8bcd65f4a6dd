// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/subpixel.hpp"

#include <algorithm>

namespace stillmap {

cv::Point2f refine_corner(const cv::Mat& scores, const Corner& corner) {
  float s[3][3];
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x)
      s[y][x] = scores.at<std::uint8_t>(corner.y + y - 1, corner.x + x - 1);
  }
  const float gx = (s[1][2] - s[1][0]) / 2, gy = (s[2][1] - s[0][1]) / 2;
  const float hxx = s[1][2] - 2 * s[1][1] + s[1][0], hyy = s[2][1] - 2 * s[1][1] + s[0][1];
  const float hxy = (s[2][2] - s[2][0] - s[0][2] + s[0][0]) / 4;
  const float det = hxx * hyy - hxy * hxy;
  cv::Point2f p(static_cast<float>(corner.x), static_cast<float>(corner.y));
  if (hxx >= 0 || hyy >= 0 || det <= 0) return p;
  const float dx = -(hyy * gx - hxy * gy) / det, dy = -(hxx * gy - hxy * gx) / det;
  p.x += std::clamp(dx, -0.5F, 0.5F);
  p.y += std::clamp(dy, -0.5F, 0.5F);
  return p;
}

}  // namespace stillmap
