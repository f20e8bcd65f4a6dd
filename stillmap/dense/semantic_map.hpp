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

/// How detections in single keyframes become things in the map.
struct SemanticOptions {
  double cell = 0.05;  ///< side of the voxels that detections are compared in [m]
  int min_views = 2;   ///< keyframes that must have found a thing
};

/// A static thing in the map.
struct StaticObject {
  int id = 0;              ///< 1, 2, 3 ... in the order in which they were first seen
  std::string class_name;  ///< the one that the detections speak for most
  float confidence = 0;    ///< sum of their confidences over the keyframes that saw its surface
  int views = 0;           ///< keyframes that found it
  int visible = 0;         ///< keyframes that saw its surface
  std::size_t points = 0;  ///< of the cloud
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of the box [m]
  /// Along the world's axes, around all but the outermost hundredth of its points on each side [m].
  Eigen::AlignedBox3d box;
};

/// The things in a cloud.
struct SemanticMap {
  std::vector<StaticObject> objects;  ///< by id
  std::vector<std::uint16_t> object;  ///< per point of the cloud: its id; 0 for none
  std::vector<float> confidence;      ///< per point, 0 to 1: of that label
  bool empty() const { return objects.empty(); }
};

/// A view, and where it was.
struct ViewAtPlace {
  const DenseView* view;
  Pose T_world_camera;
};

/// Joins the instances of all views into things, and gives every point of the cloud the thing that
/// most views speak for: each view that saw it as part of an instance votes for that instance's
/// thing with the detector's confidence, and the confidence of the label is the sum of the votes
/// over the number of views that saw the point. (YOLO11n and Lucas-Kanade's semantic map, where the
/// last detection wins, and things are not told from each other.)
/// @param views those that the grid is made of
/// @param cells per point of the cloud, the number of its voxel in the grid
SemanticMap make_semantic_map(const StaticGrid& grid, std::span<const ViewAtPlace> views,
                              std::span<const std::uint32_t> cells,
                              const SemanticOptions& options = {});

}  // namespace stillmap
