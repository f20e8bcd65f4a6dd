// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/keyframe_cloud.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stillmap {
namespace {

constexpr float kLargest = std::numeric_limits<std::int16_t>::max();

float packing_step(const std::vector<Voxel>& voxels) {
  float largest = 0;
  for (const Voxel& voxel : voxels) largest = std::max(largest, voxel.mean.cwiseAbs().maxCoeff());
  return largest > 0 ? largest / kLargest : 1;
}

PackedPoint packed(const Voxel& voxel, float step) {
  const auto units = [&](int axis) {
    const float rounded = std::round(voxel.mean[axis] / step);
    return static_cast<std::int16_t>(std::clamp(rounded, -kLargest, kLargest));
  };
  return {.position = {units(0), units(1), units(2)},
          .color = voxel.color,
          .count = static_cast<std::uint8_t>(std::min<std::uint32_t>(voxel.count, 255))};
}

KeyframeCloud packed(const VoxelGrid& grid) {
  const std::vector<Voxel> voxels = grid.voxels();
  const float step = packing_step(voxels);
  KeyframeCloud cloud{.step = step, .voxel = grid.edge()};
  cloud.points.reserve(voxels.size());
  for (const Voxel& voxel : voxels) cloud.points.push_back(packed(voxel, step));
  return cloud;
}

void require_colours(const PointGrid& grid, const RgbdFrame& frame) {
  const bool fits = frame.color.type() == CV_8UC3 &&
                    (grid.points.rows - 1) * grid.stride < frame.color.rows &&
                    (grid.points.cols - 1) * grid.stride < frame.color.cols;
  if (fits) return;
  throw Error("the colour image is not an 8-bit BGR image of the depth image's size",
              "dense keyframe " + std::to_string(frame.index),
              "register colour and depth to one size before they enter the map");
}

}  // namespace

KeyframeCloud pack_keyframe(const PointGrid& grid, const RgbdFrame& frame, double voxel) {
  require_colours(grid, frame);
  VoxelGrid voxels(voxel, grid.points.total());
  for (int row = 0; row < grid.points.rows; ++row) {
    for (int col = 0; col < grid.points.cols; ++col) {
      const cv::Vec3f& p = grid.points(row, col);
      if (!(p[2] > 0)) continue;
      const auto& bgr = frame.color.at<cv::Vec3b>(row * grid.stride, col * grid.stride);
      voxels.add({p[0], p[1], p[2]}, {bgr[2], bgr[1], bgr[0]});
    }
  }
  return packed(voxels);
}

KeyframeCloud thinned(const KeyframeCloud& cloud, double voxel) {
  VoxelGrid voxels(voxel, cloud.points.size());
  for (const PackedPoint& point : cloud.points) {
    const auto& [x, y, z] = point.position;
    voxels.add(Eigen::Vector3d(x, y, z) * cloud.step, point.color, point.count);
  }
  return packed(voxels);
}

}  // namespace stillmap
