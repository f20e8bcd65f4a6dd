// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Side of a cell [pixels].
inline constexpr int kCellSide = 4;

/// A depth image on a grid of cells of 4 x 4 pixels: fine enough for a hand, coarse enough to
/// process every surface in every frame. Immutable once made.
struct CellGrid {
  cv::Mat1f depth;      ///< Rows x columns, depth [m]; 0 where unknown.
  Camera camera;        ///< Camera of the grid, whose pixels are the cells.
  Camera image_camera;  ///< Camera of the full image.
  /// Largest difference of two depths of one surface, one measured from another pose [m].
  DepthPolynomial<float> tolerance;

  CellGrid() = default;
  /// Sets each cell to the first known depth of its four central pixels, as a mean would lie
  /// between the surfaces at an edge.
  CellGrid(const cv::Mat& full_depth, const Camera& full_camera);

  cv::Size size() const { return depth.size(); }
  /// Returns the cell of a pixel of the full image, clamped to the grid.
  cv::Point cell_of(float u, float v) const;
};

using CellGridPtr = std::shared_ptr<const CellGrid>;

/// Standard deviation of a depth up to which cues use the surface [m]: that of a Kinect v1 at 5 m,
/// beyond which the distortion of its depth exceeds the noise.
inline constexpr double kJudgedSigma = 0.041404;

/// Motion of the camera while it exposes the rows of a depth image. Zero for a camera at rest and
/// for images that are exposed at their timestamps.
struct ExposureMotion {
  /// Velocity of the camera in its own frame [m/s, rad/s].
  Eigen::Vector3f v = Eigen::Vector3f::Zero(), w = Eigen::Vector3f::Zero();
  ShutterTiming timing = {};

  ExposureMotion() = default;
  /// @param twist velocity (v, w)
  ExposureMotion(const Eigen::Matrix<double, 6, 1>& twist, const ShutterTiming& shutter)
      : v(twist.head<3>().cast<float>()), w(twist.tail<3>().cast<float>()), timing(shutter) {}
};

/// Projects the cells of a grid into the grid of the same camera at another pose, row by row, so
/// that a row is computed without branches in vector instructions. The poses are those at the
/// timestamps; rows that are exposed at other times are corrected by the camera's motion.
class Reprojection {
 public:
  /// @param motion, other_motion those of the grid and of the other one
  Reprojection(const CellGrid& grid, const Pose& T_other_camera, const ExposureMotion& motion = {},
               const ExposureMotion& other_motion = {});
  void to_row(int row);
  /// Returns per column of the row the other grid's cell as row * columns + column, or -1 where the
  /// depth is unknown or the point is outside the other view.
  const std::vector<int>& cells() const { return cells_; }
  /// Returns per column of the row the point's depth in the other camera [m].
  const std::vector<float>& depths() const { return depths_; }

 private:
  float row_time(float row, const ShutterTiming& timing) const;

  const CellGrid& grid_;
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
  ExposureMotion motion_, other_;
  std::vector<float> x_, depths_;  // x_: x of the columns' rays at z = 1
  std::vector<int> cells_;
};

/// Calls f(row, column, z, cell', z') for every cell with depth, in rows, whose point projects into
/// the grid of the same camera at another pose, at cell' = row' * columns + column' and depth z'.
template <typename F>
void for_each_reprojected(const CellGrid& grid, Reprojection other, F&& f) {
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
