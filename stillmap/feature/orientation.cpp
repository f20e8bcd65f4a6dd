// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/brief.hpp"
#include "stillmap/feature/byte_vector.hpp"

#include <cmath>

namespace stillmap {
namespace {

constexpr int kRadius = 15;

/// Row y of the disc as a mask over columns -15 ... 16, for y = 0 ... 15.
struct DiscMask {
  alignas(32) std::array<std::array<std::uint8_t, 32>, kRadius + 1> rows{};
  constexpr DiscMask() {
    for (int y = 0; y <= kRadius; ++y) {
      for (int x = -kRadius; x <= kRadius; ++x) {
        // All pixels up to half a pixel outside the radius, for a rounder disc.
        const bool inside = 4 * (x * x + y * y) <= (2 * kRadius + 1) * (2 * kRadius + 1);
        rows[y][x + kRadius] = inside ? 0xff : 0;
      }
    }
  }
};
constexpr DiscMask kDisc;

/// Column sums of the intensity and of the intensity times y. Both fit 16 bits: 31 * 255 and 255 *
/// (1 + ... + 15).
struct ColumnSums {
  I16x16 plain[2]{}, times_y[2]{};
};

STILLMAP_KERNEL I16x16 sixteen(const std::uint8_t* p, const std::uint8_t* mask) {
  const U8x16 bytes = load<U8x16>(p) & load<U8x16>(mask);
  return __builtin_convertvector(bytes, I16x16);
}

STILLMAP_KERNEL PatchMoments moments_of(const std::uint8_t* center, std::ptrdiff_t stride) {
  const std::uint8_t* left = center - kRadius;
  ColumnSums sums;
  for (int half = 0; half < 2; ++half) {
    const int x = 16 * half;
    I16x16 plain = sixteen(left + x, kDisc.rows[0].data() + x);
    I16x16 times_y{};
    for (int y = 1; y <= kRadius; ++y) {
      const std::uint8_t* mask = kDisc.rows[y].data() + x;
      const I16x16 below = sixteen(left + y * stride + x, mask);
      const I16x16 above = sixteen(left - y * stride + x, mask);
      plain += below + above;
      times_y += (below - above) * static_cast<std::int16_t>(y);
    }
    sums.plain[half] = plain;
    sums.times_y[half] = times_y;
  }
  PatchMoments m;
  for (int i = 0; i < 32; ++i) {
    m.m10 += (i - kRadius) * sums.plain[i / 16][i % 16];
    m.m01 += sums.times_y[i / 16][i % 16];
  }
  return m;
}

STILLMAP_KERNEL void moments_of_all(const cv::Mat& image, std::span<const Corner> corners,
                                    std::span<PatchMoments> moments) {
  const auto stride = static_cast<std::ptrdiff_t>(image.step);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    moments[i] = moments_of(image.data + corners[i].y * stride + corners[i].x, stride);
  }
}

void moments_portable(const cv::Mat& image, std::span<const Corner> corners,
                      std::span<PatchMoments> moments) {
  moments_of_all(image, corners, moments);
}
STILLMAP_TARGET_AVX2 void moments_avx2(const cv::Mat& image, std::span<const Corner> corners,
                                       std::span<PatchMoments> moments) {
  moments_of_all(image, corners, moments);
}

}  // namespace

float PatchMoments::angle() const {
  return std::atan2(static_cast<float>(m01), static_cast<float>(m10));
}

void patch_moments(const cv::Mat& image, std::span<const Corner> corners,
                   std::span<PatchMoments> moments, CpuPath path) {
  const TraceScope scope("orientation");
  const auto compute = path == CpuPath::kAvx2 ? moments_avx2 : moments_portable;
  compute(image, corners, moments);
}

}  // namespace stillmap
