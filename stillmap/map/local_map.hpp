// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/map.hpp"

#include <memory>
#include <span>
#include <vector>

namespace stillmap {

/// A landmark as the tracker needs it.
struct LocalLandmark {
  LandmarkId id;
  Eigen::Vector3d p_world;
  Eigen::Vector3d normal;
  float min_distance, max_distance;
  Descriptor descriptor;
  int observations;
  float static_log_odds;
};

/// A keyframe as the tracker needs it.
struct LocalKeyframe {
  KeyframeId id;
  Pose T_world_camera;
  FeaturesPtr features;
  std::vector<LandmarkId> landmarks;  ///< per keypoint
};

/// A published copy of the map around one keyframe: all that the tracker sees of the map. Never
/// changed once made, so it needs no lock.
struct LocalMap {
  std::size_t made_for_frame = 0;  ///< frame index of the reference; 0 for one of a run before
  std::uint32_t component = 0;     ///< which of the unconnected maps
  KeyframeId reference;            ///< the newest keyframe
  std::vector<LocalKeyframe> keyframes;  ///< the reference first, then by shared landmarks
  std::vector<LocalLandmark> landmarks;  ///< sorted by id
  const LocalLandmark* find(LandmarkId id) const;
  /// Its place in `landmarks`, where it must be.
  std::size_t index(LandmarkId id) const {
    return static_cast<std::size_t>(find(id) - landmarks.data());
  }
  const LocalKeyframe* find(KeyframeId id) const;
};

using LocalMapPtr = std::shared_ptr<const LocalMap>;

struct LocalMapOptions {
  int max_keyframes = 60;  ///< covisible with the reference, and then those covisible with the best
  int second_neighbors = 10;  ///< of how many of the best the neighbors are taken too
  int min_shared = 10;        ///< landmarks that make two keyframes neighbors
  STILLMAP_FIELDS(max_keyframes, second_neighbors, min_shared)
};

/// The keyframe that shows most of these landmarks (invalid ones are passed over), the newest of
/// equals; invalid if none shows any.
KeyframeId best_view(const Map& map, std::span<const LandmarkId> landmarks);

/// Copies the part of the map that a camera near keyframe `reference` can see.
LocalMapPtr make_local_map(const Map& map, KeyframeId reference, const LocalMapOptions& options);

}  // namespace stillmap
