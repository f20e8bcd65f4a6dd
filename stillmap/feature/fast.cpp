// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/fast.hpp"

#include "stillmap/feature/byte_vector.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

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

/// Necessary for a corner at `threshold`, from four ring pixels: any arc of 9 holds one of each two
/// opposite pixels, so both pairs must have a pixel that is bright (or dark) enough.
template <typename V>
STILLMAP_KERNEL bool may_hold_corners(const std::uint8_t* p, const RingOffsets& ring,
                                      const V& threshold) {
  const V north = load<V>(p + ring[0]), east = load<V>(p + ring[4]);
  const V south = load<V>(p + ring[8]), west = load<V>(p + ring[12]);
  const V brightest = lower(higher(north, south), higher(east, west));
  const V darkest = higher(lower(north, south), lower(east, west));
  const V centre = load<V>(p);
  const V most = higher(excess(brightest, centre), excess(centre, darkest));
  return any(excess(most, threshold));
}

/// FAST score of sizeof(V) neighbouring pixels. `bright` becomes the largest over all arcs of 9 of
/// the arc's darkest pixel, `dark` the smallest of the brightest. The arcs that start at i and i +
/// 1 share eight pixels, so they are taken in pairs: min(min of the eight, max of the two ends).
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
  const V centre = load<V>(p);
  return higher(excess(bright, centre), excess(centre, dark));
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

/// Scores that are maxima of their 3 x 3 neighbourhood, else 0.
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
void maxima_of_row_portable(const std::uint8_t* row, std::ptrdiff_t stride, int count,
                            std::uint8_t* out) {
  maxima_of_row<U8x16>(row, stride, count, out);
}
STILLMAP_TARGET_AVX2 void maxima_of_row_avx2(const std::uint8_t* row, std::ptrdiff_t stride,
                                             int count, std::uint8_t* out) {
  maxima_of_row<U8x32>(row, stride, count, out);
}

/// Appends a corner for each byte of `row` that is not 0.
void append_corners(const std::uint8_t* row, int count, int x0, int y,
                    std::vector<Corner>& corners) {
  for (int x = 0; x < count; x += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, row + x, 8);
    if (eight == 0) continue;
    for (int i = x; i < std::min(x + 8, count); ++i) {
      if (row[i] != 0) corners.push_back({x0 + i, y, row[i]});
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
  corners_.clear();
  const int width = image.cols - 2 * border_, height = image.rows - 2 * border_;
  if (width <= 0 || height <= 0) return corners_;

  score_buffer_.resize(std::max(score_buffer_.size(), image.total()));
  scores_ = cv::Mat(image.size(), CV_8UC1, score_buffer_.data());
  // One pixel more on each side, so that the outermost corners have neighbours to be compared with.
  fast_scores(image, {border_ - 1, border_ - 1, width + 2, height + 2}, threshold_low_, scores_,
              path_);

  const int columns = (width + cell_ - 1) / cell_;
  cell_is_strong_.assign(static_cast<std::size_t>(columns) * ((height + cell_ - 1) / cell_), 0);
  find_maxima();
  keep_strong_in_their_cells(columns);
  return corners_;
}

void FastDetector::find_maxima() {
  const auto maxima = path_ == CpuPath::kAvx2 ? maxima_of_row_avx2 : maxima_of_row_portable;
  const int width = scores_.cols - 2 * border_;
  row_.assign(static_cast<std::size_t>(width) + 8, 0);
  for (int y = border_; y < scores_.rows - border_; ++y) {
    maxima(scores_.ptr(y) + border_, static_cast<std::ptrdiff_t>(scores_.step), width, row_.data());
    append_corners(row_.data(), width, border_, y, corners_);
  }
}

void FastDetector::keep_strong_in_their_cells(int columns) {
  const auto cell_of = [&](const Corner& c) -> std::uint8_t& {
    return cell_is_strong_[(c.y - border_) / cell_ * columns + (c.x - border_) / cell_];
  };
  for (const Corner& c : corners_) {
    if (c.score > threshold_) cell_of(c) = 1;
  }
  std::erase_if(corners_,
                [&](const Corner& c) { return c.score <= threshold_ && cell_of(c) != 0; });
}

}  // namespace stillmap
