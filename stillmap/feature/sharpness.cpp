// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/sharpness.hpp"

namespace stillmap {
namespace {

/// Returns the sum over a 2x2 block with the upper left pixel `upper[x]`.
int block(const std::uint8_t* upper, const std::uint8_t* lower, int x) {
  return upper[x] + upper[x + 1] + lower[x] + lower[x + 1];
}

}  // namespace

double sharpness(const cv::Mat& gray) {
  constexpr int kRowStep = 8;
  std::int64_t sum = 0, count = 0;
  for (int y = 0; y + 3 < gray.rows; y += kRowStep) {
    const std::uint8_t* row[4];
    for (int i = 0; i < 4; ++i) row[i] = gray.ptr<std::uint8_t>(y + i);
    for (int x = 0; x + 3 < gray.cols; x += 2) {
      const int here = block(row[0], row[1], x);
      const int right = here - block(row[0], row[1], x + 2);
      const int below = here - block(row[2], row[3], x);
      sum += right * right + below * below;
      ++count;
    }
  }
  return static_cast<double>(sum) / (16.0 * static_cast<double>(count));
}

}  // namespace stillmap
