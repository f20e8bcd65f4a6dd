// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

#include <memory>
#include <span>
#include <vector>

namespace stillmap {

/// The data of a landmark that the tracker needs; positions in the world frame [m].
struct LocalLandmark {
  LandmarkId id;
  Eigen::Vector3d p_world;
  Eigen::Vector3d normal;
  float min_distance, max_distance;
  Descriptor descriptor;
  int observations;
  float static_log_odds;
};

/// The data of a keyframe that the tracker needs.
struct LocalKeyframe {
  KeyframeId id;
  Pose T_world_camera;
  FeaturesPtr features;
  std::vector<LandmarkId> landmarks;  ///< One per keypoint; invalid where it shows no landmark.
};

/// Local map snapshot: an immutable copy of the map around one keyframe. It is all that the tracker
/// reads of the map, so the map needs no lock.
struct LocalMap {
  /// Frame index of the reference keyframe; 0 if it belongs to an earlier session.
  std::size_t made_for_frame = 0;
  KeyframeId reference;  ///< Keyframe in the center of the snapshot.
  /// Whether the world frame is that of a saved map: the map's oldest component, with a first
  /// keyframe of an earlier session.
  bool of_saved_map = false;
  /// The reference comes first, then by descending number of shared landmarks.
  std::vector<LocalKeyframe> keyframes;
  std::vector<LocalLandmark> landmarks;  ///< Sorted by id.
  DepthErrorPtr depth_error;             ///< See Map::depth_error().
  const LocalLandmark* find(LandmarkId id) const;
  /// Index in `landmarks` of a landmark that must be contained.
  std::size_t index(LandmarkId id) const {
    return static_cast<std::size_t>(find(id) - landmarks.data());
  }
  const LocalKeyframe* find(KeyframeId id) const;
};

using LocalMapPtr = std::shared_ptr<const LocalMap>;

/// Returns the keyframe that observes most of these landmarks, the newest of equals; invalid if
/// none does. Invalid ids are ignored.
KeyframeId best_view(const Map& map, std::span<const LandmarkId> landmarks);

/// Copies the part of the map that a camera near keyframe `reference` can see.
LocalMapPtr make_local_map(const Map& map, KeyframeId reference);

}  // namespace stillmap
