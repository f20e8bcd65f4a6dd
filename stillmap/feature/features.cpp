// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/features.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {

KeypointGrid::KeypointGrid(std::span<const Keypoint> keypoints, int width, int height)
    : columns_((width + kCell - 1) / kCell), rows_((height + kCell - 1) / kCell) {
  const auto cell_of = [this](const Keypoint& k) {
    const int x = std::clamp(static_cast<int>(k.u) / kCell, 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>(k.v) / kCell, 0, rows_ - 1);
    return y * columns_ + x;
  };
  begin_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  for (const Keypoint& k : keypoints) ++begin_[cell_of(k) + 1];
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  entries_.resize(keypoints.size());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t i = 0; i < keypoints.size(); ++i) {
    const Keypoint& k = keypoints[i];
    entries_[next[cell_of(k)]++] = {k.u, k.v, i, k.level};
  }
}

std::size_t KeypointGrid::bytes() const {
  return begin_.size() * sizeof(std::uint32_t) + entries_.size() * sizeof(Entry);
}

std::size_t Features::bytes() const {
  return keypoints.size() * sizeof(Keypoint) + descriptors.size() * sizeof(Descriptor) +
         grid.bytes();
}

double PyramidShape::scale(int level) const { return std::pow(scale_factor, level); }

}  // namespace stillmap
