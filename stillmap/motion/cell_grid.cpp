// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/cell_grid.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Tolerance of depths: nearly three standard deviations of the difference of two readings, which
/// is sqrt(2) times that of one, and a floor [m] for the error of the poses and the size of the
/// cells.
constexpr double kToleranceSigmas = 3.75, kToleranceFloor = 0.03;

bool is_depth(float z) { return z > 0 && z < 1e3F; }  // false for NaN too

Camera grid_camera(const Camera& camera) {
  Camera small = camera;
  constexpr double kShift = (kCellSide - 1) / 2.0;  // a cell's center in the full image
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
      camera(grid_camera(full_camera)),
      image_camera(full_camera),
      tolerance(full_camera.depth_sensor.tolerance<float>(kToleranceSigmas, kToleranceFloor)) {
  const TraceScope scope(span::kCells);
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

Reprojection::Reprojection(const CellGrid& grid, const Pose& T_other_camera,
                           const ExposureMotion& motion, const ExposureMotion& other_motion)
    : grid_(grid),
      R_(T_other_camera.rotation().cast<float>()),
      t_(T_other_camera.translation().cast<float>()),
      motion_(motion),
      other_(other_motion),
      x_(static_cast<std::size_t>(grid.depth.cols)),
      depths_(x_.size()),
      cells_(x_.size()) {
  const auto fx = static_cast<float>(grid.camera.fx), cx = static_cast<float>(grid.camera.cx);
  for (std::size_t c = 0; c < x_.size(); ++c) x_[c] = (static_cast<float>(c) - cx) / fx;
}

/// Returns the time of a row's exposure after the timestamp [s].
float Reprojection::row_time(float row, const ShutterTiming& timing) const {
  const float share = (row + 0.5F) / static_cast<float>(grid_.depth.rows) - 0.5F;
  return share * static_cast<float>(timing.readout) + static_cast<float>(timing.depth_delay);
}

/// A point p of the row's camera is at p + dt (v + w x p) in the camera of the timestamp, and from
/// there at p' - dt' (v' + w' x p') in the other row's camera.
void Reprojection::to_row(int row) {
  const Camera& camera = grid_.camera;
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  const int columns = grid_.depth.cols;
  const auto width = static_cast<float>(columns) - 0.5F;
  const auto height = static_cast<float>(grid_.depth.rows) - 0.5F;
  const float y = (static_cast<float>(row) - cy) / fy;
  const float dt = row_time(static_cast<float>(row), motion_.timing);
  Eigen::Matrix3f turned = Eigen::Matrix3f::Identity();
  for (int i = 0; i < 3; ++i) turned.col(i) += dt * motion_.w.cross(Eigen::Vector3f::Unit(i));
  const Eigen::Matrix3f R = R_ * turned;
  const Eigen::Vector3f ray = R.col(1) * y + R.col(2), step = R.col(0);
  const Eigen::Vector3f t = t_ + R_ * (dt * motion_.v);
  const Eigen::Vector3f v_other = other_.v, w_other = other_.w;
  const float first_time = row_time(0, other_.timing);
  const float time_step = row_time(1, other_.timing) - first_time;
  const float *depth = grid_.depth.ptr<float>(row), *x = x_.data();
  float* depths = depths_.data();
  int* cells = cells_.data();
  for (int c = 0; c < columns; ++c) {
    const float z = depth[c];
    const float px = (ray.x() + step.x() * x[c]) * z + t.x();
    const float py = (ray.y() + step.y() * x[c]) * z + t.y();
    const float pz = (ray.z() + step.z() * x[c]) * z + t.z();
    const float time = first_time + time_step * (fy * py / pz + cy);
    const float x_other = px - time * (v_other.x() + w_other.y() * pz - w_other.z() * py);
    const float y_other = py - time * (v_other.y() + w_other.z() * px - w_other.x() * pz);
    const float z_other = pz - time * (v_other.z() + w_other.x() * py - w_other.y() * px);
    const float u = fx * x_other / z_other + cx;
    const float v = fy * y_other / z_other + cy;
    // NaN and pixels outside the view become -0.5 before the conversion to an integer.
    const bool seen =
        (z > 0) & (z_other >= 0.1F) & (u >= -0.5F) & (v >= -0.5F) & (u < width) & (v < height);
    const int r = static_cast<int>((seen ? v : -0.5F) + 0.5F);
    const int k = static_cast<int>((seen ? u : -0.5F) + 0.5F);
    depths[c] = z_other;
    cells[c] = seen ? r * columns + k : -1;
  }
}

}  // namespace stillmap
