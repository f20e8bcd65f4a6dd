// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/voxel_grid.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stillmap {

/// One point of a KeyframeCloud in ten bytes.
struct PackedPoint {
  std::array<std::int16_t, 3> position = {};  ///< camera frame, in units of KeyframeCloud::step
  Rgb color = {};
  std::uint8_t count = 1;  ///< pixels it is the mean of, at most 255
};
static_assert(sizeof(PackedPoint) == 10);

/// What a keyframe saw, in its own camera frame, so that it can be placed anew whenever its pose
/// changes.
struct KeyframeCloud {
  double step =
      1;  ///< unit of the positions [m]: the largest coordinate over 32767 (0.12 mm at 4 m)
  double voxel = 0.0;  ///< side of the voxels the points were reduced to [m]
  std::vector<PackedPoint> points = {};

  std::size_t bytes() const { return sizeof(*this) + points.capacity() * sizeof(PackedPoint); }
};

/// Reduces the points of a grid to one per voxel of side `voxel` [m] and packs them; colours are
/// those of the frame's pixels. Throws Error if voxel <= 0 or the colour image does not fit the
/// grid.
KeyframeCloud pack_keyframe(const PointGrid& grid, const RgbdFrame& frame, double voxel);

/// The same cloud reduced to a coarser voxel [m].
KeyframeCloud thinned(const KeyframeCloud& cloud, double voxel);

}  // namespace stillmap
