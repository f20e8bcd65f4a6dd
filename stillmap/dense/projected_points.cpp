// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/projected_points.hpp"

#include "stillmap/dense/voxel_index.hpp"

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

PointGroups::PointGroups(const std::vector<Eigen::Vector3f>& points) {
  VoxelIndex index;
  std::vector<std::vector<std::size_t>> members;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto voxel = voxel_at(points[i].cast<double>(), kSide);
    if (!voxel) continue;
    const std::uint32_t group = index.add(*voxel);
    if (group == members.size()) members.emplace_back();
    members[group].push_back(i);
  }
  for (std::uint32_t group = 0; group < members.size(); ++group) {
    const std::size_t first = places_.size();
    for (const std::size_t i : members[group]) {
      places_.push_back(i);
      points_.push_back(points[i]);
    }
    groups_.push_back({center_of(index.voxel(group), kSide).cast<float>(), first, places_.size()});
  }
}

}  // namespace stillmap
