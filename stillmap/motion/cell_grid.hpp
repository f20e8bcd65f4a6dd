// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <memory>

#include <opencv2/core.hpp>

namespace stillmap {

/// Pixels along the side of a cell.
inline constexpr int kCellSide = 4;

/// A depth image on a grid of cells of 4 x 4 pixels: fine enough for a hand, coarse enough to look
/// at every surface in every frame. Never changed once made.
struct CellGrid {
  cv::Mat1f depth;      ///< rows x columns, metres along the optical axis; 0 where unknown
  Camera camera;        ///< of the grid: its pixels are cells
  Camera image_camera;  ///< of the image

  CellGrid() = default;
  /// Takes of each cell the first known depth of its four central pixels: no mean, which at an
  /// edge would lie on neither side.
  CellGrid(const cv::Mat& full_depth, const Camera& full_camera);

  cv::Size size() const { return depth.size(); }
  /// The cell of a pixel of the full image, within the grid.
  cv::Point cell_of(float u, float v) const;
};

using CellGridPtr = std::shared_ptr<const CellGrid>;

/// Three standard deviations of the difference of two depths measured at z metres, one of them
/// seen from elsewhere: structured light's noise, which grows with z squared (Khoshelham and
/// Elberink, Sensors 2012, eq. 10), and a floor for the poses' error and the cells' size. [m]
inline float depth_tolerance(float z) { return 0.03F + 0.006F * z * z; }

/// Calls f(row, column, z, row', column', z') for every cell with depth, in rows, whose point,
/// taken to another camera, falls on cell (row', column') of a grid of the same camera at depth z'.
template <typename F>
void for_each_reprojected(const CellGrid& grid, const Pose& T_other_camera, F&& f) {
  const Camera& camera = grid.camera;
  const Eigen::Matrix3f R = T_other_camera.rotation().cast<float>();
  const Eigen::Vector3f t = T_other_camera.translation().cast<float>();
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  const int rows = grid.depth.rows, columns = grid.depth.cols;
  const auto width = static_cast<float>(columns) - 0.5F, height = static_cast<float>(rows) - 0.5F;
  for (int r = 0; r < rows; ++r) {
    const float* depth = grid.depth.ptr<float>(r);
    const Eigen::Vector3f row_ray = R.col(1) * ((static_cast<float>(r) - cy) / fy) + R.col(2);
    for (int c = 0; c < columns; ++c) {
      const float z = depth[c];
      if (z <= 0) continue;
      const float x = (static_cast<float>(c) - cx) / fx;
      const float pz = (row_ray.z() + R(2, 0) * x) * z + t.z();
      if (pz < 0.1F) continue;
      const float iz = 1.0F / pz;
      const float u = fx * ((row_ray.x() + R(0, 0) * x) * z + t.x()) * iz + cx;
      const float v = fy * ((row_ray.y() + R(1, 0) * x) * z + t.y()) * iz + cy;
      if (u < -0.5F || v < -0.5F || u >= width || v >= height) continue;
      f(r, c, z, static_cast<int>(v + 0.5F), static_cast<int>(u + 0.5F), pz);
    }
  }
}

}  // namespace stillmap
