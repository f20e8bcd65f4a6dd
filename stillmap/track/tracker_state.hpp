// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/local_map.hpp"
#include "stillmap/optimize/pose_solver.hpp"
#include "stillmap/track/tracked_frame.hpp"

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Motion of the camera since the previous frame by IMU and wheels.
struct MotionPrior {
  Pose T_previous_camera;
  /// As that of PosePrior, with the uncertainty of the previous pose.
  Matrix6d information = Matrix6d::Zero();
};

/// The previous frame and its place in the local map: input of the next frame's pose.
struct TrackerState {
  LocalMapPtr local_map;     ///< newest snapshot; null while there is no map
  TrackedFramePtr previous;  ///< newest frame with a pose; null before the first
  Pose T_world_previous;     ///< pose of `previous` in the world of `local_map`
  Pose T_previous_next;      ///< predicted motion to the next frame (constant velocity)
  Eigen::Matrix<double, 6, 1> twist =
      Eigen::Matrix<double, 6, 1>::Zero();  ///< velocity of the camera in its frame [m/s, rad/s]
  std::optional<MotionPrior> motion_prior;  ///< none without IMU and wheels, unless at rest
  bool at_rest = false;  ///< Whether the newest frame shows the camera at rest: see RestDetector.
  /// Per keypoint of `previous` if that was tracked by odometry, else empty: world position [m] at
  /// which its point was first observed. So errors accumulate per point and not per frame.
  std::vector<std::optional<Eigen::Vector3d>> odometry_points;

  std::optional<PosePrior> prior() const {
    if (!motion_prior) return std::nullopt;
    return PosePrior{T_world_previous * motion_prior->T_previous_camera, motion_prior->information};
  }

  /// Returns false after a frame whose velocity was not known, so that its keypoints are not
  /// compensated either: the first one of a map.
  bool velocity_known() const {
    return previous->state != TrackState::kStarted || !previous->frame->twist.isZero();
  }
};

/// Returns the pose of a tracked frame in the world of a local map, or none if the map does not
/// contain the frame's reference keyframe.
std::optional<Pose> pose_in(const LocalMap& local_map, const TrackedFrame& tracked);

}  // namespace stillmap
