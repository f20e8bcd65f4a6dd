// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/static_grid.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace stillmap {

/// A static object in the map.
struct StaticObject {
  int id = 0;              ///< 1, 2, 3 ... in the order of their first detections.
  std::string class_name;  ///< Class with the largest sum of confidences.
  float confidence = 0;    ///< That sum over the number of keyframes that saw its surface [0..1].
  int views = 0;           ///< Number of keyframes that detected it.
  int visible = 0;         ///< Number of keyframes that saw its surface.
  std::size_t points = 0;  ///< Number of its points in the cloud.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< Center of the box [m].
  /// Box along the world's axes around its points without the outermost 1 % on each side [m].
  Eigen::AlignedBox3d box;
};

/// The objects in a cloud.
struct SemanticMap {
  std::vector<StaticObject> objects;  ///< By id.
  std::vector<std::uint16_t> object;  ///< Id of the object of each point of the cloud; 0 for none.
  std::vector<float> confidence;      ///< Confidence of that label of each point [0..1].
  bool empty() const { return objects.empty(); }
};

/// A view with its pose.
struct PosedView {
  const DenseView* view;
  Pose T_world_camera;
};

/// Merges the instances of all views into objects, and labels every point of the cloud by votes:
/// each view with the point in an instance votes for that instance's object with the detector's
/// confidence, and the confidence of the label is the sum of the votes over the number of views
/// that saw the point.
/// @param views views of the grid
/// @param cells number of the voxel in the grid of each point of the cloud
SemanticMap make_semantic_map(const StaticGrid& grid, std::span<const PosedView> views,
                              std::span<const std::uint32_t> cells);

}  // namespace stillmap
