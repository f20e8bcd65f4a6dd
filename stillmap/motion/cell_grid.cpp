// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/cell_grid.hpp"

#include <algorithm>

namespace stillmap {
namespace {

bool is_depth(float z) { return z > 0 && z < 1e3F; }  // false for NaN too

Camera shrunk(const Camera& camera) {
  Camera small = camera;
  constexpr double kShift = (kCellSide - 1) / 2.0;  // a cell's centre in the full image
  small.width = camera.width / kCellSide;
  small.height = camera.height / kCellSide;
  small.fx = camera.fx / kCellSide;
  small.fy = camera.fy / kCellSide;
  small.cx = (camera.cx - kShift) / kCellSide;
  small.cy = (camera.cy - kShift) / kCellSide;
  return small;
}

}  // namespace

CellGrid::CellGrid(const cv::Mat& full_depth, const Camera& full_camera)
    : depth(full_camera.height / kCellSide, full_camera.width / kCellSide),
      camera(shrunk(full_camera)),
      image_camera(full_camera) {
  for (int r = 0; r < depth.rows; ++r) {
    const float* upper = full_depth.ptr<float>(r * kCellSide + 1);
    const float* lower = full_depth.ptr<float>(r * kCellSide + 2);
    float* cell = depth.ptr<float>(r);
    for (int c = 0; c < depth.cols; ++c) {
      const int x = c * kCellSide + 1;
      cell[c] = 0;
      for (const float z : {upper[x], lower[x + 1], upper[x + 1], lower[x]}) {
        if (!is_depth(z)) continue;
        cell[c] = z;
        break;
      }
    }
  }
}

cv::Point CellGrid::cell_of(float u, float v) const {
  return {std::clamp(static_cast<int>(u) / kCellSide, 0, depth.cols - 1),
          std::clamp(static_cast<int>(v) / kCellSide, 0, depth.rows - 1)};
}

}  // namespace stillmap
