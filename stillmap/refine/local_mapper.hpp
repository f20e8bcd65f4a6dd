// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/keyframe_proposal.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/refine/culling.hpp"
#include "stillmap/refine/landmark_creation.hpp"
#include "stillmap/refine/landmark_fusion.hpp"
#include "stillmap/refine/local_adjustment.hpp"

#include <vector>

#include <Eigen/Core>

namespace stillmap {

struct MapperOptions {
  int local_window = 15;      ///< Maximum number of keyframes that local adjustment optimizes.
  int fusion_keyframes = 10;  ///< Maximum number of neighbors for fuse_duplicates().
  /// Largest standard deviation of a depth from which a landmark is created [m]; farther landmarks
  /// are triangulated. The default is that of a Kinect v1 at 6 m.
  double max_landmark_sigma = 0.060784;
  /// The same for the first keyframe of a map [m].
  double max_first_landmark_sigma = 0.060784;
  /// Number of nearest keypoints of a keyframe that get a landmark whatever their depth.
  std::size_t fewest_depth_landmarks = 0;
  bool remove_depth_error = true;  ///< Whether depth_error_of() the map is removed.
};

/// Summary of the refinement of one keyframe, for log and run summary.
struct RefineReport {
  int triangulated = 0, fused = 0, landmarks_culled = 0, keyframes_culled = 0;
  /// Positions of the landmarks erased as KeyframeProposal::repeated, in the world frame [m].
  std::vector<Eigen::Vector3d> repeated;
  BundleResult adjustment;
};

/// Sum of the reports of all keyframes.
struct RefineTotals {
  long triangulated = 0, fused = 0, landmarks_culled = 0, keyframes_culled = 0;
  std::vector<Eigen::Vector3d> repeated;
  void add(const RefineReport& report);
};

/// Maintains the map around the newest keyframe. Synchronous: the pipeline runs it in a thread.
class LocalMapper {
 public:
  /// The map may already contain components.
  LocalMapper(Map& map, const MapperOptions& options);

  /// Adds the keyframe with the tracker's matches, erases the landmarks that repeat others, and
  /// creates landmarks from the depth of the other keypoints. A proposal without reference starts a
  /// new component. Returns the new keyframe.
  KeyframeId insert(const KeyframeProposal& proposal);

  /// Refines the map around the keyframe: triangulation, fusion of duplicates, local bundle
  /// adjustment, culling. `stop` ends the adjustment early.
  RefineReport refine(KeyframeId newest, const StopRequest& stop = {});

  /// Returns the local map snapshot around a keyframe.
  LocalMapPtr local_map(KeyframeId reference) const { return make_local_map(map_, reference); }

 private:
  void erase_repeated(const std::vector<LandmarkId>& repeated);

  Map& map_;
  MapperOptions options_;
  std::vector<Eigen::Vector3d> repeated_;  // since the last refine()
};

}  // namespace stillmap
