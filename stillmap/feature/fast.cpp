// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/fast.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/byte_vector.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

namespace stillmap {
namespace {

/// The circle of radius 3, clockwise from the top (Rosten and Drummond 2006, figure 1).
constexpr int kRing[16][2] = {{0, -3}, {1, -3},  {2, -2},  {3, -1}, {3, 0},  {3, 1},
                              {2, 2},  {1, 3},   {0, 3},   {-1, 3}, {-2, 2}, {-3, 1},
                              {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};

using RingOffsets = std::array<std::ptrdiff_t, 16>;

RingOffsets ring_offsets(std::ptrdiff_t stride) {
  RingOffsets offsets{};
  for (int i = 0; i < 16; ++i) offsets[i] = kRing[i][1] * stride + kRing[i][0];
  return offsets;
}

/// Necessary condition for a corner at `threshold`, from four ring pixels: an arc of 9 contains one
/// of every two opposite pixels, so both pairs need a pixel that is bright (or dark) enough.
template <typename V>
STILLMAP_KERNEL bool may_hold_corners(const std::uint8_t* p, const RingOffsets& ring,
                                      const V& threshold) {
  const V north = load<V>(p + ring[0]), east = load<V>(p + ring[4]);
  const V south = load<V>(p + ring[8]), west = load<V>(p + ring[12]);
  const V brightest = lower(higher(north, south), higher(east, west));
  const V darkest = higher(lower(north, south), lower(east, west));
  const V center = load<V>(p);
  const V most = higher(excess(brightest, center), excess(center, darkest));
  return any(excess(most, threshold));
}

/// FAST score of sizeof(V) neighboring pixels. `bright` becomes the maximum over all arcs of 9 of
/// the arc's darkest pixel, `dark` the minimum of the brightest. The arcs that start at i and i + 1
/// share eight pixels, so they are evaluated in pairs: min(min of the eight, max of the two ends).
template <typename V>
STILLMAP_KERNEL V corner_score(const std::uint8_t* p, const RingOffsets& ring) {
  V v[16], low[16], high[16];
  for (int i = 0; i < 16; ++i) v[i] = load<V>(p + ring[i]);
  for (int i = 1; i < 16; i += 2) {
    low[i] = lower(v[i], v[(i + 1) % 16]);
    high[i] = higher(v[i], v[(i + 1) % 16]);
  }
  V low4[16], high4[16];
  for (int i = 1; i < 16; i += 2) {
    low4[i] = lower(low[i], low[(i + 2) % 16]);
    high4[i] = higher(high[i], high[(i + 2) % 16]);
  }
  V bright{};
  V dark = ~V{};
  for (int i = 1; i < 16; i += 2) {
    const V& end = v[i - 1];
    const V& other_end = v[(i + 8) % 16];
    const V eight_low = lower(low4[i], low4[(i + 4) % 16]);
    const V eight_high = higher(high4[i], high4[(i + 4) % 16]);
    bright = higher(bright, lower(eight_low, higher(end, other_end)));
    dark = lower(dark, higher(eight_high, lower(end, other_end)));
  }
  const V center = load<V>(p);
  return higher(excess(bright, center), excess(center, dark));
}

template <typename Wide>
STILLMAP_KERNEL void score_area(const std::uint8_t* image, std::ptrdiff_t stride,
                                const cv::Rect& area, std::uint8_t threshold, std::uint8_t* scores,
                                std::ptrdiff_t scores_stride) {
  const RingOffsets ring = ring_offsets(stride);
  for (int y = area.y; y < area.y + area.height; ++y) {
    const std::uint8_t* p = image + y * stride + area.x;
    std::uint8_t* out = scores + y * scores_stride + area.x;
    cover<Wide>(area.width, [&]<typename V>(int x) STILLMAP_ALWAYS_INLINE {
      const V t = V{} + threshold;
      V score{};
      if (may_hold_corners<V>(p + x, ring, t)) {
        score = corner_score<V>(p + x, ring);
        score = score > t ? score : V{};
      }
      store(out + x, score);
    });
  }
}

/// Keeps scores that are maxima of their 3 x 3 neighborhood, else 0.
template <typename Wide>
STILLMAP_KERNEL void maxima_of_row(const std::uint8_t* row, std::ptrdiff_t stride, int count,
                                   std::uint8_t* out) {
  cover<Wide>(count, [&]<typename V>(int x) STILLMAP_ALWAYS_INLINE {
    const auto at = [&](int dx, int dy)
                        STILLMAP_ALWAYS_INLINE { return load<V>(row + x + dy * stride + dx); };
    const V before = higher(higher(at(-1, -1), at(0, -1)), higher(at(1, -1), at(-1, 0)));
    const V after = higher(higher(at(-1, 1), at(0, 1)), higher(at(1, 1), at(1, 0)));
    const V score = at(0, 0);
    const V not_below_before = score >= before ? score : V{};
    store(out + x, score > after ? not_below_before : V{});
  });
}

/// Maxima of a band of rows, in consecutive rows of `width` and then `out_gap` bytes; and the
/// maximum of each column.
template <typename Wide>
STILLMAP_KERNEL void maxima_of_band(const std::uint8_t* scores, std::ptrdiff_t stride,
                                    cv::Size size, std::uint8_t* out, std::ptrdiff_t out_gap,
                                    std::uint8_t* highest) {
  for (int y = 0; y < size.height; ++y) {
    maxima_of_row<Wide>(scores, stride, size.width, out);
    cover<Wide>(size.width, [&]<typename V>(int x) STILLMAP_ALWAYS_INLINE {
      store(highest + x, higher(load<V>(highest + x), load<V>(out + x)));
    });
    scores += stride;
    out += size.width + out_gap;
  }
}

/// Sets the row to zero where it is not above the limit.
template <typename Wide>
STILLMAP_KERNEL void keep_above(const std::uint8_t* limit, int count, std::uint8_t* row) {
  cover<Wide>(count, [&]<typename V>(int x) STILLMAP_ALWAYS_INLINE {
    const V v = load<V>(row + x);
    store(row + x, v > load<V>(limit + x) ? v : V{});
  });
}

void score_area_portable(const std::uint8_t* image, std::ptrdiff_t stride, const cv::Rect& area,
                         std::uint8_t threshold, std::uint8_t* scores,
                         std::ptrdiff_t scores_stride) {
  score_area<U8x16>(image, stride, area, threshold, scores, scores_stride);
}
STILLMAP_TARGET_AVX2 void score_area_avx2(const std::uint8_t* image, std::ptrdiff_t stride,
                                          const cv::Rect& area, std::uint8_t threshold,
                                          std::uint8_t* scores, std::ptrdiff_t scores_stride) {
  score_area<U8x32>(image, stride, area, threshold, scores, scores_stride);
}
void maxima_portable(const std::uint8_t* scores, std::ptrdiff_t stride, cv::Size size,
                     std::uint8_t* out, std::ptrdiff_t out_gap, std::uint8_t* highest) {
  maxima_of_band<U8x16>(scores, stride, size, out, out_gap, highest);
}
STILLMAP_TARGET_AVX2 void maxima_avx2(const std::uint8_t* scores, std::ptrdiff_t stride,
                                      cv::Size size, std::uint8_t* out, std::ptrdiff_t out_gap,
                                      std::uint8_t* highest) {
  maxima_of_band<U8x32>(scores, stride, size, out, out_gap, highest);
}
void keep_above_portable(const std::uint8_t* limit, int count, std::uint8_t* row) {
  keep_above<U8x16>(limit, count, row);
}
STILLMAP_TARGET_AVX2 void keep_above_avx2(const std::uint8_t* limit, int count, std::uint8_t* row) {
  keep_above<U8x32>(limit, count, row);
}

constexpr int kGap = 8;  // Zeros after each row of maxima, so that eight can be read at a time.

/// Appends a corner for each byte of `row` that is not 0.
void append_corners(const std::uint8_t* row, int count, int x0, int y,
                    std::vector<Corner>& corners) {
  static_assert(std::endian::native == std::endian::little);
  for (int x = 0; x < count; x += 8) {
    for (auto eight = load<std::uint64_t>(row + x); eight != 0;) {
      const int i = std::countr_zero(eight) / 8;
      corners.push_back({x0 + x + i, y, row[x + i]});
      eight &= ~(0xffULL << (8 * i));
    }
  }
}

}  // namespace

void fast_scores(const cv::Mat& image, const cv::Rect& area, int threshold, cv::Mat& scores,
                 CpuPath path) {
  const auto score = path == CpuPath::kAvx2 ? score_area_avx2 : score_area_portable;
  score(image.data, static_cast<std::ptrdiff_t>(image.step), area,
        static_cast<std::uint8_t>(threshold), scores.data,
        static_cast<std::ptrdiff_t>(scores.step));
}

FastDetector::FastDetector(int threshold, int threshold_low, int cell, int border, CpuPath path)
    : threshold_(threshold),
      threshold_low_(threshold_low),
      cell_(cell),
      border_(border),
      path_(path) {}

const std::vector<Corner>& FastDetector::detect(const cv::Mat& image) {
  const TraceScope scope("FAST");
  corners_.clear();
  const int width = image.cols - 2 * border_, height = image.rows - 2 * border_;
  if (width <= 0 || height <= 0) return corners_;

  score_buffer_.resize(std::max(score_buffer_.size(), image.total()));
  scores_ = cv::Mat(image.size(), CV_8UC1, score_buffer_.data());
  // One pixel of margin on each side, so that the outermost corners have neighbors.
  fast_scores(image, {border_ - 1, border_ - 1, width + 2, height + 2}, threshold_low_, scores_,
              path_);

  maxima_.assign(static_cast<std::size_t>(width + kGap) * cell_, 0);
  for (int y = border_; y < border_ + height; y += cell_) {
    detect_in_band(y, {width, std::min(cell_, border_ + height - y)});
  }
  return corners_;
}

void FastDetector::detect_in_band(int y0, cv::Size size) {
  const auto find_maxima = path_ == CpuPath::kAvx2 ? maxima_avx2 : maxima_portable;
  const auto keep = path_ == CpuPath::kAvx2 ? keep_above_avx2 : keep_above_portable;
  limit_.assign(size.width, 0);
  find_maxima(scores_.ptr(y0) + border_, static_cast<std::ptrdiff_t>(scores_.step), size,
              maxima_.data(), kGap, limit_.data());
  highest_to_limit();
  for (int y = 0; y < size.height; ++y) {
    std::uint8_t* row = maxima_.data() + static_cast<std::ptrdiff_t>(y) * (size.width + kGap);
    keep(limit_.data(), size.width, row);
    append_corners(row, size.width, border_, y0 + y, corners_);
  }
}

/// Computes the required score of each cell from the maxima of its columns: the first threshold if
/// any score exceeds it, otherwise none, since all scores exceed the second threshold.
void FastDetector::highest_to_limit() {
  for (auto cell = limit_.begin(); cell != limit_.end();) {
    const auto end = cell + std::min<std::ptrdiff_t>(cell_, limit_.end() - cell);
    const bool strong = *std::max_element(cell, end) > threshold_;
    std::fill(cell, end, static_cast<std::uint8_t>(strong ? threshold_ : 0));
    cell = end;
  }
}

}  // namespace stillmap
