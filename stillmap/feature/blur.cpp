// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/brief.hpp"
#include "stillmap/feature/byte_vector.hpp"

#include <algorithm>

namespace stillmap {
namespace {

using Taps = std::array<const std::uint8_t*, 7>;

constexpr int kReach = 3;
/// exp(-d^2 / (2 * 2^2)) for d = 0 ... 3, scaled so that the seven weights sum to 256.
constexpr std::uint16_t kWeights[kReach + 1] = {56, 49, 33, 18};
static_assert(kWeights[0] + 2 * (kWeights[1] + kWeights[2] + kWeights[3]) == 256);

/// out[x] = weighted sum of taps[0][x] ... taps[6][x]. In 16 bits: 256 * 255 + 128 < 2^16.
STILLMAP_KERNEL void weigh(const Taps& taps, int count, std::uint8_t* __restrict out) {
  const std::uint8_t *a3 = taps[0], *a2 = taps[1], *a1 = taps[2], *middle = taps[3];
  const std::uint8_t *b1 = taps[4], *b2 = taps[5], *b3 = taps[6];
  for (int x = 0; x < count; ++x) {
    std::uint16_t sum = 128;
    sum += static_cast<std::uint16_t>(kWeights[0] * middle[x]);
    sum += static_cast<std::uint16_t>(kWeights[1] * static_cast<std::uint16_t>(a1[x] + b1[x]));
    sum += static_cast<std::uint16_t>(kWeights[2] * static_cast<std::uint16_t>(a2[x] + b2[x]));
    sum += static_cast<std::uint16_t>(kWeights[3] * static_cast<std::uint16_t>(a3[x] + b3[x]));
    out[x] = static_cast<std::uint8_t>(sum >> 8);
  }
}

void weigh_portable(const Taps& taps, int count, std::uint8_t* out) { weigh(taps, count, out); }
STILLMAP_TARGET_AVX2 void weigh_avx2(const Taps& taps, int count, std::uint8_t* out) {
  weigh(taps, count, out);
}

/// Reflects -1, -2, -3 to 1, 2, 3; likewise at the other end.
int reflect(int i, int count) {
  if (i < 0) return -i;
  return i < count ? i : 2 * (count - 1) - i;
}

}  // namespace

const cv::Mat& Blur::operator()(const cv::Mat& image) {
  const TraceScope scope("blur");
  const auto weigh_rows = path_ == CpuPath::kAvx2 ? weigh_avx2 : weigh_portable;
  const int width = image.cols, height = image.rows;
  buffer_.resize(std::max(buffer_.size(), image.total()));
  blurred_ = cv::Mat(image.size(), CV_8UC1, buffer_.data());
  row_.resize(std::max(row_.size(), static_cast<std::size_t>(width) + 2 * kReach));

  Taps taps{};
  for (int y = 0; y < height; ++y) {
    for (int d = -kReach; d <= kReach; ++d) taps[d + kReach] = image.ptr(reflect(y + d, height));
    std::uint8_t* row = row_.data() + kReach;
    weigh_rows(taps, width, row);
    for (int d = 1; d <= kReach; ++d) {
      row[-d] = row[d];
      row[width - 1 + d] = row[width - 1 - d];
    }
    for (int d = -kReach; d <= kReach; ++d) taps[d + kReach] = row + d;
    weigh_rows(taps, width, blurred_.ptr(y));
  }
  return blurred_;
}

}  // namespace stillmap
