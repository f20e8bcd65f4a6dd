// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Pixels along the side of a cell.
inline constexpr int kCellSide = 4;

/// A depth image on a grid of cells of 4 x 4 pixels: fine enough for a hand, coarse enough to look
/// at every surface in every frame. Never changed once made.
struct CellGrid {
  cv::Mat1f depth;      ///< rows x columns, meters along the optical axis; 0 where unknown
  Camera camera;        ///< of the grid: its pixels are cells
  Camera image_camera;  ///< of the image
  /// How far two depths of one surface may differ, one of them measured from another pose.
  DepthPolynomial<float> tolerance;

  CellGrid() = default;
  /// Takes of each cell the first known depth of its four central pixels: no mean, which at an
  /// edge would lie on neither side.
  CellGrid(const cv::Mat& full_depth, const Camera& full_camera);

  cv::Size size() const { return depth.size(); }
  /// The cell of a pixel of the full image, within the grid.
  cv::Point cell_of(float u, float v) const;
};

using CellGridPtr = std::shared_ptr<const CellGrid>;

/// Standard deviation of a depth up to which cues judge the surface [m]. It is that of a Kinect v1
/// at 5 m; beyond, its depth is warped by more than its noise.
inline constexpr double kJudgedSigma = 0.041404;

/// Where the cells of a grid fall in the grid of the same camera standing elsewhere. Row by row, so
/// that a row is computed without a branch, as vectors.
class Reprojection {
 public:
  Reprojection(const CellGrid& grid, const Pose& T_other_camera);
  void to_row(int row);
  /// Of the row, per column: the other grid's cell as row * columns + column; -1 where the depth is
  /// unknown or the point is out of the other's sight.
  const std::vector<int>& cells() const { return cells_; }
  /// Of the row, per column: the point's depth in the other camera; meters.
  const std::vector<float>& depths() const { return depths_; }

 private:
  const CellGrid& grid_;
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
  std::vector<float> x_, depths_;  // x_: of the columns' rays, where z is 1
  std::vector<int> cells_;
};

/// Calls f(row, column, z, cell', z') for every cell with depth, in rows, whose point, taken to
/// another camera, falls on a cell' (row' * columns + column') of a grid of the same camera, at
/// depth z'.
template <typename F>
void for_each_reprojected(const CellGrid& grid, const Pose& T_other_camera, F&& f) {
  Reprojection other(grid, T_other_camera);
  for (int r = 0; r < grid.depth.rows; ++r) {
    other.to_row(r);
    const float* depth = grid.depth.ptr<float>(r);
    const int* cell = other.cells().data();
    const float* z = other.depths().data();
    for (int c = 0; c < grid.depth.cols; ++c) {
      if (cell[c] >= 0) f(r, c, depth[c], cell[c], z[c]);
    }
  }
}

}  // namespace stillmap
