// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stage_times.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/track/tracker.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stillmap {

/// Times of one frame on the tracker's thread, by stage [ms].
struct TrackingTimes {
  float features = 0;
  float masks = 0;    ///< Time spent waiting for mask propagation [ms].
  float motion = 0;   ///< Time of motion estimation [ms].
  float pose = 0;     ///< Time of pose estimation [ms].
  float waiting = 0;  ///< Time spent waiting for the network and the map, not in the total [ms].
  /// Returns the time of all stages without waiting [ms].
  float total() const { return features + masks + motion + pose; }
};

/// Why a pose is uncertain.
enum class Uncertainty : std::uint8_t {
  kNone,           ///< It is not.
  kContradiction,  ///< It contradicts the motion of the camera (see MotionConsistency), or the
                   ///< background seems to move (see background_moves()).
  kMinority,       ///< Nearly all keypoints move: see kUncertainMajority.
};

/// Small summary of one frame, kept for the whole run.
struct FrameRecord {
  std::size_t index = 0;                    ///< Index of the frame in the run.
  double timestamp = 0;                     ///< Time of the frame [s].
  TrackState state = TrackState::kWaiting;  ///< State of the tracker after the frame.
  std::string reason;    ///< Reason why the camera was lost; empty if it was not.
  KeyframeId reference;  ///< Keyframe that the pose is relative to.
  /// Component of the final map with the pose; none without a pose or before the end of the run.
  std::optional<std::uint32_t> component;
  Pose T_reference_camera;                 ///< Relative pose, valid while the map is corrected.
  Matrix6d covariance = Matrix6d::Zero();  ///< See TrackedFrame::covariance.
  Pose T_camera_filtered;                  ///< See TrackedFrame::T_camera_filtered.
  /// Upward direction in the camera, see TrackedFrame::up; zero: not known.
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  int keypoints = 0;                 ///< Number of keypoints.
  int moving_keypoints = 0;          ///< Number of keypoints labeled as moving.
  int inliers = 0;                   ///< Number of landmarks that agree with the pose.
  int mask_age = -1;                 ///< Age of the masks [frames]; -1 without masks.
  bool relocalized = false;          ///< The lost camera was relocalized in this frame.
  bool tracked_by_odometry = false;  ///< See TrackedFrame::tracked_by_odometry.
  bool tracked_late = false;         ///< The pose was found at the end: see LateTracking.
  Uncertainty uncertainty = Uncertainty::kNone;
  bool keyframe = false;                   ///< The frame was proposed as a keyframe.
  Dynamics dynamics = Dynamics::kUnknown;  ///< Verdict of the dynamics gate.
  TrackingTimes times;

  bool uncertain() const { return uncertainty != Uncertainty::kNone; }
  bool has_pose() const { return state != TrackState::kWaiting && state != TrackState::kLost; }
  /// Returns whether the pose is by an IMU or wheels alone.
  bool predicted() const { return state == TrackState::kPredicted; }
  /// Returns the share of keypoints that are labeled as moving [0..1].
  double moving_share() const {
    return keypoints > 0 ? static_cast<double>(moving_keypoints) / keypoints : 0;
  }
};

/// Returns the upward direction of the world of the poses, by the newest frame that knows it.
std::optional<Eigen::Vector3d> upward(const std::vector<FrameRecord>& frames,
                                      const Trajectory& poses);

/// Returns why a pose is uncertain.
Uncertainty uncertainty_of(const TrackedFrame& tracked);

/// Returns T_world_camera of a frame in the map; none without a pose or in a dropped map.
std::optional<Pose> pose_in(const Map& map, const FrameRecord& record);

/// Returns the number of frames in each component.
std::map<std::uint32_t, int> frames_by_component(const std::vector<FrameRecord>& frames);

/// A frame with a pose, relative to a keyframe.
struct PlacedFrame {
  double timestamp = 0;  ///< Time of the frame [s].
  KeyframeId reference;  ///< Invalid for the first frame of a map: its pose is T_world_camera.
  Pose T_reference_camera;
};

/// Copy of the frames pushed so far, for other threads.
struct LoggedFrames {
  std::optional<FrameRecord> newest;
  std::vector<PlacedFrame> placed;  ///< Frames with a pose.
  /// Final poses by ascending timestamps, once there are any; null before.
  std::shared_ptr<const Trajectory> final_poses;
};

/// The records of all frames of a run, and their poses in the corrected map. Used by the thread
/// that pushes frames. Only copy() may be called by other threads, at any time; no stage owns the
/// log, so this is the only class besides Stage with a mutex.
class FrameLog {
 public:
  /// @param extends_map false if the map is only localized in, so that no keyframe is made
  explicit FrameLog(bool extends_map) : extends_map_(extends_map) {}

  /// A log of these records, by ascending index.
  explicit FrameLog(std::vector<FrameRecord> records)
      : extends_map_(true), records_(std::move(records)) {}

  /// Sets whether frames extend the map from now on.
  void set_extend(bool extend) { extends_map_ = extend; }

  /// Adds the record of a frame.
  void add(const TrackedFrame& tracked, const TrackingTimes& times);
  /// Makes the poses of frames that became keyframes relative to their own keyframes.
  void settle(const std::vector<NewKeyframe>& made);
  /// Adds the pose of an earlier frame of the lost camera, whose relocalization the tracker
  /// accepted.
  void confirm(const RelocalizationResult& relocalization);
  /// Adds or replaces the pose of a frame, found at the end of the run.
  void place(std::size_t frame_index, KeyframeId reference, const Pose& T_reference_camera,
             const PoseEstimate& estimate);

  /// Sets the final poses for copy().
  void set_final_poses(Trajectory poses);

  /// Returns the frames pushed so far. May be called by any thread.
  LoggedFrames copy() const;

  bool empty() const { return records_.empty(); }
  const FrameRecord& back() const { return records_.back(); }
  const std::vector<FrameRecord>& records() const { return records_; }
  /// Returns the position in records() of a frame that was added.
  std::size_t position(std::size_t frame_index) const;

  /// Returns T_world_camera by frame index in the current map, without frames that have no pose or
  /// belong to a dropped map.
  std::map<std::size_t, Pose> poses(const Map& map) const;
  /// Returns the same poses with their timestamps and covariances, as uninterrupted paths: one ends
  /// where the next pose is in another component of the map or more than half a second later.
  std::vector<std::vector<UncertainPose>> paths(const Map& map) const;
  /// Returns the records with the components of their poses.
  std::vector<FrameRecord> records_in(const Map& map) const;
  /// Adds one sample per frame for each stage of the tracker's thread, in the order of
  /// TrackingTimes, and for their sum, "tracking".
  void add_times_to(StageTimes& times) const;

 private:
  void correct_predicted(const TrackedFrame& tracked);
  FrameRecord& record_of(std::size_t frame_index) { return records_[position(frame_index)]; }

  bool extends_map_;
  std::shared_ptr<const Trajectory> final_poses_;  // under the mutex
  /// Frames whose maps were started again by the next frame, until that is a keyframe: index of
  /// that frame, and the relative pose.
  std::map<std::size_t, TrackedFrame::Earlier> earlier_;
  std::vector<FrameRecord> records_;  // changed by the pushing thread only, under the mutex
  mutable std::mutex mutex_;
};

}  // namespace stillmap
