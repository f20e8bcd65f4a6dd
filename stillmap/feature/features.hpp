// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A corner detected at one level of the scale pyramid, in pixels of the full-size image.
struct Keypoint {
  float u = 0, v = 0;  ///< Sub-pixel position [pixels].
  float angle = 0;     ///< Orientation of the patch by its intensity centroid, in (-pi, pi] [rad].
  float response = 0;  ///< Corner score, comparable within one image.
  float depth = 0;     ///< Depth along the optical axis [m]; 0: unknown.
  std::uint8_t level = 0;  ///< Pyramid level, 0 is full size.
};

/// 256 binary tests (BRIEF), steered by the keypoint's angle.
using Descriptor = std::array<std::uint64_t, 4>;

/// Returns the Hamming distance, 0 to 256 [bits].
inline int distance(const Descriptor& a, const Descriptor& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
         std::popcount(a[3] ^ b[3]);
}

/// Keypoints sorted into square cells, for neighborhood queries in constant time. Immutable.
class KeypointGrid {
 public:
  KeypointGrid() = default;
  KeypointGrid(std::span<const Keypoint> keypoints, int width, int height);
  /// A copy that takes its memory from `memory`, which must outlive it.
  KeypointGrid(const KeypointGrid& other, std::pmr::memory_resource* memory)
      : columns_(other.columns_),
        rows_(other.rows_),
        begin_(other.begin_, memory),
        entries_(other.entries_, memory) {}

  /// Returns the memory that it takes [bytes].
  std::size_t bytes() const;

  /// Calls f(index) for every keypoint within the square |du| <= radius, |dv| <= radius with a
  /// level in [min_level, max_level], in an order that depends on the keypoints only.
  template <typename F>
  void for_each_near(float u, float v, float radius, int min_level, int max_level, F&& f) const;

 private:
  struct Entry {
    float u, v;
    std::uint32_t index;
    std::uint8_t level;
  };
  static constexpr int kCell = 16;  // pixels
  int columns_ = 0, rows_ = 0;
  std::pmr::vector<std::uint32_t> begin_;  // first entry of each cell; one more at the end
  std::pmr::vector<Entry> entries_;        // by cell, then by index
};

/// Features of one frame. Immutable after creation.
struct Features {
  Features() = default;
  /// A copy that takes its memory from `memory`, which must outlive it.
  Features(const Features& other, std::pmr::memory_resource* memory)
      : keypoints(other.keypoints, memory),
        descriptors(other.descriptors, memory),
        grid(other.grid, memory) {}

  std::pmr::vector<Keypoint> keypoints;
  std::pmr::vector<Descriptor> descriptors;  ///< One per keypoint.
  KeypointGrid grid;
  /// Returns the memory that they take [bytes].
  std::size_t bytes() const;
  std::size_t size() const { return keypoints.size(); }
};

using FeaturesPtr = std::shared_ptr<const Features>;

/// Geometry of the scale pyramid: level l is the image reduced by scale_factor^l.
struct PyramidShape {
  int levels = 8;
  double scale_factor = 1.2;
  double scale(int level) const;  ///< Returns scale_factor^level.
};

template <typename F>
void KeypointGrid::for_each_near(float u, float v, float radius, int min_level, int max_level,
                                 F&& f) const {
  if (columns_ == 0) return;
  const auto cell = [](float x, int count) {
    return std::min(std::max(static_cast<int>(x) / kCell, 0), count - 1);
  };
  const int x0 = cell(u - radius, columns_), x1 = cell(u + radius, columns_);
  const int y0 = cell(v - radius, rows_), y1 = cell(v + radius, rows_);
  for (int y = y0; y <= y1; ++y) {
    const auto first = begin_[y * columns_ + x0], last = begin_[y * columns_ + x1 + 1];
    for (auto i = first; i < last; ++i) {
      const Entry& e = entries_[i];
      if (e.level < min_level || e.level > max_level) continue;
      if (std::abs(e.u - u) <= radius && std::abs(e.v - v) <= radius) f(e.index);
    }
  }
}

}  // namespace stillmap
