// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/labeled_cloud.hpp"

#include "stillmap/geometry/trimmed_box.hpp"
#include "stillmap/geometry/voxel_key.hpp"

#include <map>
#include <utility>

namespace stillmap {
namespace {

constexpr double kCell = 0.1;  // side of the voxels that points are connected by [m]
// Minimum number of points of an object: a quarter of that of make_semantic_map(), since the live
// cloud has voxels of twice the side.
constexpr std::size_t kMinPoints = 15;

/// The points of one class by voxel.
using PointsOfVoxels = std::map<Voxel, std::vector<Eigen::Vector3d>>;

/// Removes the voxels that are connected with the first one, and returns their points.
std::vector<Eigen::Vector3d> take_connected(PointsOfVoxels& voxels) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Voxel> open{voxels.begin()->first};
  while (!open.empty()) {
    const Voxel voxel = open.back();
    open.pop_back();
    auto taken = voxels.extract(voxel);
    if (taken.empty()) continue;
    points.insert(points.end(), taken.mapped().begin(), taken.mapped().end());
    const Lattice center = lattice_of(voxel);
    for (int i = 0; i < 27; ++i) {
      const Voxel next = voxel_of(center + Lattice(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (voxels.contains(next)) open.push_back(next);
    }
  }
  return points;
}

}  // namespace

std::vector<StaticObject> connected_objects(const LabeledCloud& labeled) {
  std::map<std::uint16_t, PointsOfVoxels> by_class;
  for (std::size_t i = 0; i < labeled.labels.size(); ++i) {
    const Eigen::Vector3d p = labeled.cloud->points[i].cast<double>();
    const auto voxel = voxel_at(p, kCell);
    if (labeled.labels[i] > 0 && voxel) by_class[labeled.labels[i]][*voxel].push_back(p);
  }
  std::vector<StaticObject> objects;
  for (auto& [label, voxels] : by_class) {
    while (!voxels.empty()) {
      const std::vector<Eigen::Vector3d> points = take_connected(voxels);
      if (points.size() < kMinPoints) continue;
      StaticObject object;
      object.id = static_cast<int>(objects.size()) + 1;
      object.class_name = labeled.classes.at(label - 1U);
      object.points = points.size();
      object.box = trimmed_box(points, points.size() / 100);
      object.center = object.box.center();
      objects.push_back(std::move(object));
    }
  }
  return objects;
}

}  // namespace stillmap
