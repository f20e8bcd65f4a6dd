// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/site_frame.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// One of the unconnected maps.
struct ComponentDescription {
  std::size_t keyframes = 0, landmarks = 0;
  Eigen::AlignedBox3d extent;  ///< Box of the landmarks between their 1 % and 99 % quantiles [m].
};

/// Summary of a saved map.
struct MapDescription {
  std::uint32_t version = 0;  ///< Version of the file layout.
  std::string writer;
  Camera camera;
  PyramidShape pyramid;
  std::size_t sessions = 0, keyframes = 0, keypoints = 0, landmarks = 0, observations = 0;
  std::vector<ComponentDescription> components;
  std::uint32_t main = 0;                  ///< See main_component().
  bool at_site = false;                    ///< Whether it is in the frame of a site.
  TagCenters tags;                         ///< Those in the main component.
  std::size_t views = 0, view_pixels = 0;  ///< Number of views of the dense map and their pixels.
  std::size_t visits = 0;                  ///< Number of visits that made these views.
};

/// Returns the summary of a saved map.
MapDescription describe_map(const SavedMap& saved);
/// Returns the summary as lines of text.
std::string description_text(const MapDescription& description);
/// Returns the summary as JSON.
nlohmann::json description_json(const MapDescription& description);

/// Returns the landmarks of the main component (main_component()) in the world [m], in white.
Cloud landmark_cloud(const SavedMap& saved);

/// Returns the keyframe poses of each session, in order of their timestamps.
/// @param component  of which the keyframes are; none: of all, which have worlds of their own
std::map<std::uint32_t, Trajectory> keyframe_trajectories(
    const MapContent& map, std::optional<std::uint32_t> component = {});

/// Returns the keyframes with their poses, and the pairs that share at least `min_shared`
/// landmarks.
nlohmann::json map_graph(const SavedMap& saved, int min_shared = 15);

/// Returns the cloud of the saved views, made as at the end of a run from the component with most
/// views. Empty if there are none.
Cloud dense_cloud(const SavedMap& saved);

}  // namespace stillmap
