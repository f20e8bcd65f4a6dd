// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"

#include <cstdint>
#include <cstring>

/// Byte vectors in the compiler's notation (GCC and Clang vector extensions): the same source gives
/// SSE2, AVX2 or NEON code and, with std::uint8_t as the "vector", the scalar reference.

namespace stillmap {

using U8x16 [[maybe_unused]] = std::uint8_t __attribute__((vector_size(16)));
using U8x32 [[maybe_unused]] = std::uint8_t __attribute__((vector_size(32)));
using I16x16 [[maybe_unused]] = std::int16_t __attribute__((vector_size(32)));

template <typename V>
STILLMAP_KERNEL V load(const void* p) {
  V v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

template <typename V>
STILLMAP_KERNEL void store(void* p, const V& v) {
  std::memcpy(p, &v, sizeof v);
}

template <typename V>
STILLMAP_KERNEL V lower(const V& a, const V& b) {
  return a < b ? a : b;
}

template <typename V>
STILLMAP_KERNEL V higher(const V& a, const V& b) {
  return a > b ? a : b;
}

/// Returns a - b where a > b, else 0.
template <typename V>
STILLMAP_KERNEL V excess(const V& a, const V& b) {
  return higher(a, b) - b;
}

/// Returns whether any byte is not zero.
template <typename V>
STILLMAP_KERNEL bool any(const V& v) {
  if constexpr (sizeof(V) == 1) {
    return v != 0;
  } else {
    std::uint64_t words[sizeof(V) / 8];
    std::memcpy(words, &v, sizeof v);
    std::uint64_t all = 0;
    for (const std::uint64_t w : words) all |= w;
    return all != 0;
  }
}

/// Calls step.template operator()<V>(x) so that [0, count) is covered by vectors of V's width; the
/// last one overlaps its predecessor instead of exceeding the end. Ranges shorter than one vector
/// are processed byte by byte.
template <typename V, typename Step>
STILLMAP_KERNEL void cover(int count, Step&& step) {
  constexpr int kWidth = sizeof(V);
  if (count < kWidth) {
    for (int x = 0; x < count; ++x) step.template operator()<std::uint8_t>(x);
    return;
  }
  int x = 0;
  for (; x + kWidth <= count; x += kWidth) step.template operator()<V>(x);
  if (x < count) step.template operator()<V>(count - kWidth);
}

}  // namespace stillmap
