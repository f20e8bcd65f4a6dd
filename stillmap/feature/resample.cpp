// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/resample.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace stillmap {
namespace {

using Tap = Shrinker::Tap;
using Block = Shrinker::Block;

constexpr int kWeightBits = 6;  // Two weights and two bytes must fit into signed 16 bits.
constexpr int kOne = 1 << kWeightBits, kHalf = kOne / 2;
// Number of result pixels of a block, and of source pixels that it may read.
constexpr int kBlock = 8, kReach = 16;

std::vector<Tap> taps(int from, int to) {
  std::vector<Tap> result(to);
  for (int i = 0; i < to; ++i) {
    const double position = (i + 0.5) * from / to - 0.5;
    const int first = std::clamp(static_cast<int>(std::floor(position)), 0, from - 2);
    const long weight = std::lround((position - first) * kOne);
    result[i] = {first, static_cast<int>(std::clamp(weight, 0L, static_cast<long>(kOne)))};
  }
  return result;
}

/// Returns the columns in blocks, the last one overlapping its predecessor; empty if a block cannot
/// cover its source pixels.
std::vector<Block> blocks_of(const std::vector<Tap>& columns) {
  std::vector<Block> blocks;
  const int count = static_cast<int>(columns.size());
  if (count < kBlock) return blocks;
  for (int x = 0; x < count; x += kBlock) {
    Block block;
    block.to = std::min(x, count - kBlock);
    block.from = columns[block.to].first;
    for (int i = 0; i < kBlock; ++i) {
      const Tap& tap = columns[block.to + i];
      const int offset = tap.first - block.from;
      if (offset + 1 >= kReach) return {};
      block.pick[2 * i] = static_cast<std::uint8_t>(offset);
      block.pick[2 * i + 1] = static_cast<std::uint8_t>(offset + 1);
      block.weight[2 * i] = static_cast<std::int8_t>(kOne - tap.weight);
      block.weight[2 * i + 1] = static_cast<std::int8_t>(tap.weight);
    }
    blocks.push_back(block);
  }
  return blocks;
}

/// Interpolates between two rows.
STILLMAP_KERNEL void mix(const std::uint8_t* a, const std::uint8_t* b, int weight, int count,
                         std::uint8_t* __restrict out) {
  const auto weight_b = static_cast<std::uint16_t>(weight);
  const auto weight_a = static_cast<std::uint16_t>(kOne - weight);
  for (int x = 0; x < count; ++x) {
    const auto sum = static_cast<std::uint16_t>(a[x] * weight_a + b[x] * weight_b + kHalf);
    out[x] = static_cast<std::uint8_t>(sum >> kWeightBits);
  }
}

void mix_portable(const std::uint8_t* a, const std::uint8_t* b, int weight, int count,
                  std::uint8_t* out) {
  mix(a, b, weight, count, out);
}
STILLMAP_TARGET_AVX2 void mix_avx2(const std::uint8_t* a, const std::uint8_t* b, int weight,
                                   int count, std::uint8_t* out) {
  mix(a, b, weight, count, out);
}

void shrink_row_portable(const std::uint8_t* row, std::span<const Tap> columns, std::uint8_t* out) {
  for (std::size_t x = 0; x < columns.size(); ++x) {
    const auto [first, weight] = columns[x];
    const int sum = row[first] * (kOne - weight) + row[first + 1] * weight + kHalf;
    out[x] = static_cast<std::uint8_t>(sum >> kWeightBits);
  }
}

#if defined(__x86_64__)
STILLMAP_TARGET_AVX2 void shrink_row_avx2(const std::uint8_t* row, std::span<const Block> blocks,
                                          std::uint8_t* out) {
  const auto load = [](const auto* p) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
  };
  const __m128i half = _mm_set1_epi16(kHalf);
  for (const Block& block : blocks) {
    const __m128i pairs = _mm_shuffle_epi8(load(row + block.from), load(block.pick.data()));
    const __m128i sums = _mm_maddubs_epi16(pairs, load(block.weight.data()));
    const __m128i rounded = _mm_srli_epi16(_mm_add_epi16(sums, half), kWeightBits);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + block.to),
                     _mm_packus_epi16(rounded, rounded));
  }
}
#else
void shrink_row_avx2(const std::uint8_t*, std::span<const Block>, std::uint8_t*) {}
#endif

}  // namespace

void Shrinker::prepare(cv::Size from, cv::Size to) {
  if (from == from_ && to == to_) return;
  from_ = from;
  to_ = to;
  columns_ = taps(from.width, to.width);
  rows_ = taps(from.height, to.height);
  blocks_.clear();
  if (path_ == CpuPath::kAvx2) blocks_ = blocks_of(columns_);
  row_.assign(static_cast<std::size_t>(from.width) + kReach, 0);
}

void Shrinker::operator()(const cv::Mat& from, cv::Size size, cv::Mat& to) {
  prepare(from.size(), size);
  to.create(size, CV_8UC1);
  const auto mix_rows = path_ == CpuPath::kAvx2 ? mix_avx2 : mix_portable;
  for (int y = 0; y < size.height; ++y) {
    const auto [first, weight] = rows_[y];
    mix_rows(from.ptr(first), from.ptr(first + 1), weight, from.cols, row_.data());
    if (blocks_.empty())
      shrink_row_portable(row_.data(), columns_, to.ptr(y));
    else
      shrink_row_avx2(row_.data(), blocks_, to.ptr(y));
  }
}

}  // namespace stillmap
