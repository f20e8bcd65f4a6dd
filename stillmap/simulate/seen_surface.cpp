// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/seen_surface.hpp"

#include "stillmap/geometry/voxel_key.hpp"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace stillmap {

void SeenSurface::add(const TruthFrame& truth) {
  const Eigen::Matrix3d R = truth.T_world_camera.rotation();
  for (int v = 0; v < truth.depth.rows; v += 2) {
    for (int u = 0; u < truth.depth.cols; u += 2) {
      const float z = truth.depth.at<float>(v, u);
      if (!(z > 0 && z <= kFarthest) || truth.instances.at<std::uint8_t>(v, u) != 0) continue;
      const Eigen::Vector3d p = R * camera_.unproject(u, v, z) + truth.T_world_camera.translation();
      Sum& voxel = voxels_[voxel_of(clamped_lattice_at(p, edge_))];
      voxel.sum += p;
      ++voxel.count;
    }
  }
}

std::vector<Eigen::Vector3f> SeenSurface::points() const {
  std::vector<std::pair<std::uint64_t, Eigen::Vector3f>> ordered;
  ordered.reserve(voxels_.size());
  for (const auto& [key, voxel] : voxels_) {
    ordered.emplace_back(key, (voxel.sum / voxel.count).cast<float>());
  }
  std::sort(ordered.begin(), ordered.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Eigen::Vector3f> points;
  points.reserve(ordered.size());
  for (const auto& [key, point] : ordered) points.push_back(point);
  return points;
}

std::string points_ply(const std::vector<Eigen::Vector3f>& points) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n",
      points.size());
  for (const Eigen::Vector3f& p : points) {
    std::array<char, 3 * sizeof(float)> raw{};
    std::memcpy(raw.data(), p.data(), raw.size());  // x86-64 is little endian
    bytes.append(raw.data(), raw.size());
  }
  return bytes;
}

}  // namespace stillmap
