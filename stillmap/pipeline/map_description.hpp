// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/saved_map.hpp"

#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// One of the unconnected maps.
struct ComponentDescription {
  std::size_t keyframes = 0, landmarks = 0;
  Eigen::AlignedBox3d
      extent;  ///< of the landmarks without the outermost hundredth on each side [m]
};

/// What there is to say about a saved map.
struct MapDescription {
  std::uint32_t version = 0;  ///< of the file's layout
  std::string writer;
  Camera camera;
  PyramidShape pyramid;
  std::size_t sessions = 0, keyframes = 0, keypoints = 0, landmarks = 0, observations = 0;
  std::vector<ComponentDescription> components;
  std::size_t views = 0, view_pixels = 0;  ///< of the dense map
};

MapDescription describe_map(const SavedMap& saved);
/// In lines for the screen.
std::string description_text(const MapDescription& description);
nlohmann::json description_json(const MapDescription& description);

/// The landmarks in the world, colored by component: 0 white, then one color after the other.
Cloud landmark_cloud(const MapContent& map);

/// By session: its keyframes, in the order of their stamps.
std::map<std::uint32_t, Trajectory> keyframe_trajectories(const MapContent& map);

/// Keyframes with their poses, and which of them share at least `min_shared` landmarks.
nlohmann::json map_graph(const SavedMap& saved, int min_shared = 15);

/// The saved views put together as at the end of a run: those of the component with most of them.
/// Empty if there are none.
Cloud dense_cloud(const SavedMap& saved);

}  // namespace stillmap
