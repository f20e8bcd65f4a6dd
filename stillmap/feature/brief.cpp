// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/brief.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/byte_vector.hpp"

#include <cmath>
#include <cstring>

namespace stillmap {
namespace {

// Fraction bits of sine and cosine; 15 * sqrt(2) * 2^10 fits 16 bits.
constexpr int kFractionBits = 10;
constexpr int kStride = 32;  // Row stride of the patch copy: columns -15 ... 16.

struct Turn {
  std::int16_t cosine, sine;
};

Turn turn_of(const PatchMoments& m) {
  const double x = m.m10, y = m.m01;
  const double norm = std::sqrt(x * x + y * y);
  if (norm == 0) return {1 << kFractionBits, 0};
  const double unit = (1 << kFractionBits) / norm;
  return {static_cast<std::int16_t>(std::lround(x * unit)),
          static_cast<std::int16_t>(std::lround(y * unit))};
}

/// Positions in the patch copy of 256 rotated points: x' = c x - s y, y' = s x + c y.
STILLMAP_KERNEL void turn_points(const std::array<std::int16_t, 256>& px,
                                 const std::array<std::int16_t, 256>& py, const Turn& turn,
                                 std::array<std::int16_t, 256>& where) {
  constexpr std::int16_t kHalf = 1 << (kFractionBits - 1);
  constexpr int kCenter = 15 * kStride + 15;
  for (int i = 0; i < 256; i += 16) {
    const I16x16 x = load<I16x16>(px.data() + i), y = load<I16x16>(py.data() + i);
    const I16x16 turned_x = (x * turn.cosine - y * turn.sine + kHalf) >> kFractionBits;
    const I16x16 turned_y = (x * turn.sine + y * turn.cosine + kHalf) >> kFractionBits;
    store(where.data() + i, turned_y * static_cast<std::int16_t>(kStride) + turned_x +
                                static_cast<std::int16_t>(kCenter));
  }
}

/// Bit i of the result, i = 0 ... 7: a[i] < b[i].
STILLMAP_KERNEL std::uint64_t darker(const std::uint8_t* a, const std::uint8_t* b) {
  using U8x8 [[maybe_unused]] = std::uint8_t __attribute__((vector_size(8)));
  constexpr U8x8 kBit = {1, 2, 4, 8, 16, 32, 64, 128};
  const auto chosen = load<U8x8>(a) < load<U8x8>(b) ? kBit : U8x8{};
  // The multiplication adds all bytes in the uppermost one.
  return (load<std::uint64_t>(&chosen) * 0x0101010101010101ULL) >> 56;
}

STILLMAP_KERNEL Descriptor describe_one(const std::uint8_t* center, std::ptrdiff_t stride,
                                        const Turn& turn, const BriefPattern& pattern) {
  alignas(32) std::array<std::uint8_t, 31 * kStride> patch;
  for (int y = 0; y < 31; ++y) {
    std::memcpy(patch.data() + y * kStride, center + (y - 15) * stride - 15, kStride);
  }
  alignas(32) std::array<std::int16_t, 256> where_a, where_b;
  turn_points(pattern.ax, pattern.ay, turn, where_a);
  turn_points(pattern.bx, pattern.by, turn, where_b);
  alignas(32) std::array<std::uint8_t, 256> a, b;
  for (int i = 0; i < 256; ++i) a[i] = patch[where_a[i]];
  for (int i = 0; i < 256; ++i) b[i] = patch[where_b[i]];
  Descriptor descriptor{};
  for (int i = 0; i < 256; i += 8)
    descriptor[i / 64] |= darker(a.data() + i, b.data() + i) << (i % 64);
  return descriptor;
}

STILLMAP_KERNEL void describe_all(const cv::Mat& image, std::span<const Corner> corners,
                                  std::span<const PatchMoments> moments, std::span<Descriptor> out,
                                  const BriefPattern& pattern) {
  const auto stride = static_cast<std::ptrdiff_t>(image.step);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint8_t* center = image.data + corners[i].y * stride + corners[i].x;
    out[i] = describe_one(center, stride, turn_of(moments[i]), pattern);
  }
}

void describe_portable(const cv::Mat& image, std::span<const Corner> corners,
                       std::span<const PatchMoments> moments, std::span<Descriptor> out,
                       const BriefPattern& pattern) {
  describe_all(image, corners, moments, out, pattern);
}
STILLMAP_TARGET_AVX2 void describe_avx2(const cv::Mat& image, std::span<const Corner> corners,
                                        std::span<const PatchMoments> moments,
                                        std::span<Descriptor> out, const BriefPattern& pattern) {
  describe_all(image, corners, moments, out, pattern);
}

}  // namespace

void describe(const cv::Mat& blurred, std::span<const Corner> corners,
              std::span<const PatchMoments> moments, std::span<Descriptor> descriptors,
              CpuPath path, const BriefPattern& pattern) {
  const TraceScope scope("describe");
  const auto compute = path == CpuPath::kAvx2 ? describe_avx2 : describe_portable;
  compute(blurred, corners, moments, descriptors, pattern);
}

}  // namespace stillmap
