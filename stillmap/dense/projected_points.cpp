// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/projected_points.hpp"

#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {

ViewProjection::ViewProjection(const PosedView& posed, float margin)
    : R_(posed.T_world_camera.rotation().transpose().cast<float>()),
      t_(posed.T_world_camera.inverse().translation().cast<float>()),
      fx_(static_cast<float>(posed.view->camera.fx)),
      fy_(static_cast<float>(posed.view->camera.fy)),
      cx_(static_cast<float>(posed.view->camera.cx)),
      cy_(static_cast<float>(posed.view->camera.cy)),
      cols_(static_cast<float>(posed.view->depth.cols)),
      rows_(static_cast<float>(posed.view->depth.rows)),
      margin_(margin) {}

std::optional<ProjectedPoint> ViewProjection::operator()(const Eigen::Vector3f& p_world) const {
  constexpr float kNearest = 0.1F;  // [m]
  const Eigen::Vector3f p = R_ * p_world + t_;
  if (p.z() < kNearest) return std::nullopt;
  const float u = fx_ * p.x() / p.z() + cx_, v = fy_ * p.y() / p.z() + cy_;
  const auto in_range = [&](float x, float size) {
    return x >= -margin_ && x <= size - 1 + margin_;
  };
  if (!in_range(u, cols_) || !in_range(v, rows_)) return std::nullopt;
  const float x = std::clamp(u, 0.0F, cols_ - 1), y = std::clamp(v, 0.0F, rows_ - 1);
  const float col = std::min(std::floor(x), cols_ - 2), row = std::min(std::floor(y), rows_ - 2);
  return ProjectedPoint{static_cast<int>(row), static_cast<int>(col), x - col, y - row, p.z()};
}

// Distances from the camera's plane, and from the four planes through its center and the borders of
// the image.
bool ViewProjection::reaches(const Eigen::Vector3f& center, float radius) const {
  const Eigen::Vector3f p = R_ * center + t_;
  if (p.z() < -radius) return false;
  const auto is_beyond = [&](float focal, float x, float border) {
    return (focal * x - border * p.z()) / std::hypot(focal, border) > radius;
  };
  return !is_beyond(fx_, p.x(), cols_ - cx_) && !is_beyond(fx_, -p.x(), cx_) &&
         !is_beyond(fy_, p.y(), rows_ - cy_) && !is_beyond(fy_, -p.y(), cy_);
}

PointGroups::PointGroups(const std::vector<Eigen::Vector3f>& points) : points_(&points) {
  VoxelIndex index;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto voxel = voxel_at(points[i].cast<double>(), kSide);
    if (!voxel) continue;
    const std::uint32_t group = index.add(*voxel);
    if (group == groups_.size()) groups_.push_back({center_of(*voxel, kSide).cast<float>(), {}});
    groups_[group].points.push_back(i);
  }
}

}  // namespace stillmap
