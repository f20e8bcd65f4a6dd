// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stage_times.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/track/tracker.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Times of one frame on the tracker's thread, by stage [ms].
struct TrackingTimes {
  float features = 0;
  float masks = 0;  ///< waiting for the masks to be propagated, once the network had found them
  float motion = 0;
  float pose = 0;
  float waiting = 0;  ///< for the network and the map; not part of the total
  float total() const { return features + masks + motion + pose; }
};

/// Summary of one frame, kept for the whole run; small.
struct FrameRecord {
  std::size_t index = 0;
  double timestamp = 0;  ///< seconds
  TrackState state = TrackState::kWaiting;
  std::string reason;                ///< why there is no pose; empty where there is one
  KeyframeId reference;              ///< keyframe that the pose is relative to
  Pose T_reference_camera;           ///< stays valid while the map is corrected
  int keypoints = 0;                 ///< number of keypoints
  int moving_keypoints = 0;          ///< number of keypoints left out because they move
  int inliers = 0;                   ///< number of landmarks that agree with the pose
  int mask_age = -1;                 ///< age of the masks [frames]; -1 where there were none
  bool relocalized = false;          ///< whether the camera was lost and was found in this frame
  bool tracked_by_odometry = false;  ///< see TrackedFrame::tracked_by_odometry
  bool keyframe = false;             ///< whether the frame was proposed as a keyframe
  TrackingTimes times;

  bool has_pose() const { return state == TrackState::kStarted || state == TrackState::kTracking; }
};

/// A frame with a pose, relative to a keyframe.
struct PlacedFrame {
  double timestamp = 0;  ///< [s]
  KeyframeId reference;  ///< invalid where the frame begins a map: the pose is one in the world
  Pose T_reference_camera;
};

/// The frames pushed so far, as another thread may see them.
struct LoggedFrames {
  std::optional<FrameRecord> newest;
  std::vector<PlacedFrame> placed;  ///< those with a pose
};

/// The records of all frames of a run, and their poses in the map as it is corrected. Used by the
/// thread that pushes frames. Only copy() may be called by others, at any time; no stage owns the
/// log, so this is the one class besides Stage with a mutex.
class FrameLog {
 public:
  /// @param extends_map false where keyframes are proposed but the map stays as it is
  explicit FrameLog(bool extends_map) : extends_map_(extends_map) {}

  void add(const TrackedFrame& tracked, const TrackingTimes& times);
  /// Frames that became keyframes stand where their keyframes stand.
  void settle(const std::vector<NewKeyframe>& made);
  /// An earlier frame of the lost camera was recognized, and the tracker agrees: the frame has a
  /// pose after all.
  void confirm(const RelocalizationResult& relocalization);

  /// Returns the frames pushed so far. May be called by any thread.
  LoggedFrames copy() const;

  bool empty() const { return records_.empty(); }
  const FrameRecord& back() const { return records_.back(); }
  const std::vector<FrameRecord>& records() const { return records_; }

  /// Returns T_world_camera by frame index in the map as it is now; frames without a pose and those
  /// of dropped maps are left out.
  std::map<std::size_t, Pose> poses(const Map& map) const;
  /// Returns the same poses with their timestamps.
  Trajectory trajectory(const Map& map) const;
  /// Returns the number of frames in each of the unconnected maps.
  std::map<std::uint32_t, int> frames_by_component(const Map& map) const;
  /// Adds the stages of the tracker's thread, a sample per frame, in the order of TrackingTimes;
  /// and their sum, as "tracking".
  void add_times_to(StageTimes& times) const;

 private:
  const bool extends_map_;
  std::vector<FrameRecord> records_;  // changed under the mutex, by the thread that pushes
  mutable std::mutex mutex_;
};

}  // namespace stillmap
