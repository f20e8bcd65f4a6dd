// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/keyframe_proposal.hpp"
#include "stillmap/motion/frame.hpp"
#include "stillmap/optimize/residual.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

enum class TrackState {
  kWaiting,    ///< There is no map yet, and the frame has too few points to start one.
  kStarted,    ///< The frame starts a map.
  kTracking,   ///< The frame has a pose in the map.
  kLost,       ///< The frame has no pose.
  kPredicted,  ///< The frame has a pose by an IMU or wheels alone: T_world_predicted.
};

/// Result of tracking one frame. Never changed once made.
struct TrackedFrame {
  FramePtr frame;
  TrackState state = TrackState::kWaiting;
  std::string reason;                  ///< why there is no pose; empty if there is one
  std::optional<Pose> T_world_camera;  ///< in the world of the local map at that time
  /// The odometry frame is the world without its corrections, by which poses jump: in it the poses
  /// of consecutive frames continue each other.
  Pose T_odometry_world;
  KeyframeId reference;     ///< keyframe the pose is relative to; invalid if the frame starts a map
  Pose T_reference_camera;  ///< stays valid when the map is corrected
  std::vector<LandmarkId> landmarks;  ///< matched landmark of each keypoint, or invalid
  /// see PoseEstimate::covariance; enlarged if the pose contradicts the motion
  Matrix6d covariance = Matrix6d::Zero();
  /// Pose of a lost camera by its IMU or wheels, which the map does not use. Of a frame without a
  /// pose: `reference`, T_reference_camera and `covariance` are those of this one. Of the first one
  /// with a pose again: to correct those before.
  std::optional<Pose> T_world_predicted;
  bool contradicts_motion = false;  ///< see MotionConsistency
  bool confirmed = false;           ///< The pose agrees with the motion of the wheels.
  /// Upward direction in the frame of the camera by the accelerometer; none if it is not known.
  std::optional<Eigen::Vector3d> up = std::nullopt;
  /// Correction of the pose by the motion before it: T_world_camera T_camera_filtered is handed out
  /// during the run; the map uses T_world_camera. See TrajectoryFilter.
  Pose T_camera_filtered;
  /// Motion since the previous frame, whatever was corrected in between, by the images, IMU or
  /// wheels; none if that has no pose in the same map.
  std::optional<Pose> T_previous_camera;
  int inliers = 0;           ///< number of landmarks that agree with the pose
  bool relocalized = false;  ///< The camera was lost, and this frame confirmed a relocalization.
  bool tracked_by_odometry = false;  ///< The pose comes from the previous frame, not from the map.
  std::optional<KeyframeProposal> proposal;
  /// Only of a frame that starts a map again: index and relative pose of the frame that started it
  /// first.
  struct Earlier {
    std::size_t frame_index = 0;
    Pose T_camera_earlier;
  };
  std::optional<Earlier> earlier;

  bool has_pose() const { return T_world_camera.has_value(); }
  /// Returns the pose that is handed out during the run, if there is one.
  std::optional<Pose> T_world_filtered() const {
    if (!T_world_camera) return T_world_predicted;
    return *T_world_camera * T_camera_filtered;
  }
  /// Returns whether it starts a map, or a part of it that was not seen before.
  bool starts_part() const { return proposal && proposal->starts_part(); }
  /// Returns whether its world may differ from that of the previous frames.
  bool enters_world() const { return state == TrackState::kStarted || relocalized; }
};

using TrackedFramePtr = std::shared_ptr<const TrackedFrame>;

}  // namespace stillmap
