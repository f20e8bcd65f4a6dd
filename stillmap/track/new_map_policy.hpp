// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <string>

namespace stillmap {

struct NewMapOptions {
  /// Number of consecutive frames without a pose, each able to start a map, before one does.
  int patience = 10;
  /// Number of consecutive frames in which a near surface occludes the view before these count as
  /// able to start a map.
  int occluded_patience = 90;
};

/// Returns why a frame cannot start a map, or an empty string if it can: it needs enough static
/// keypoints with depth, spread over the image.
std::string reason_against_new_map(const Frame& frame, const Camera& camera);

/// Returns whether a near surface occludes the camera: over half of the landmarks that should be
/// visible from its last pose are behind a surface within reach and much nearer than they are.
bool is_occluded(const TrackingModel& model, const LocalMap& local_map, const Pose& T_world_camera,
                 const Frame& frame);

/// Decides when a lost camera starts a new map: after a while, and later if it is occluded, because
/// the occluding object is likely to go away.
class NewMapPolicy {
 public:
  explicit NewMapPolicy(const NewMapOptions& options) : options_(options) {}

  /// Counts a frame without a pose and returns whether it should start a map.
  /// @param local_map      newest snapshot; null while there is no map
  /// @param T_world_camera last known pose of the camera
  bool wants_map(const TrackingModel& model, const LocalMapPtr& local_map,
                 const Pose& T_world_camera, const Frame& frame);
  /// Notes that a frame has a pose.
  void reset() { candidates_ = occluded_ = 0; }

 private:
  NewMapOptions options_;
  int candidates_ = 0;  // frames since the last pose that could have started a map
  int occluded_ = 0;    // frames since the last pose that were occluded
};

}  // namespace stillmap
