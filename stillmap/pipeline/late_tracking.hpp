// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/page_file.hpp"
#include "stillmap/pipeline/frame_log.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <cstddef>
#include <deque>
#include <memory>
#include <utility>

namespace stillmap {

/// A frame that is to be tracked again.
struct KeptFrame {
  FramePtr frame;
  bool reliable = false;  // whether its pose is to be relied on
  bool with_imu = false;  // whether its pose and covariance may be by the IMU, too
  std::shared_ptr<const Pages> pages = nullptr;  // of the keypoints; null: they are in memory
};

/// Tracks frames again in the map at the end of a run. By then its landmarks are more accurate, it
/// contains those that were made after a frame and none that move, and a frame can be tracked from
/// the frames that follow it.
class LateTracking {
 public:
  /// @param memory  for the keypoints of the frames; further ones are in a temporary file
  /// @param imu     whether the IMU of the camera supports poses
  LateTracking(MemoryLimit memory, bool imu)
      : file_(std::move(memory), "the frames to be tracked again"), imu_(imu) {}

  /// Keeps the keypoints and the motion evidence of a frame without its images, unless wheels or a
  /// camera at rest confirm its pose. Of too many frames the oldest are dropped.
  void add(const TrackedFrame& tracked);

  /// Tracks each frame in the map from its pose, and places it in the log. A frame whose pose is
  /// not to be relied on is also tracked from between the poses of the frames before and after it
  /// or, at the ends of a longer gap, from the nearest pose, and gets the pose that more landmarks
  /// agree with. Not to be relied on are no pose, one that contradicts the motion of the camera,
  /// that of a frame most of whose keypoints move, and those of the first frames of each map, in
  /// which moving objects were not yet known.
  /// @param min_inliers minimum number of landmarks that agree with a pose
  void track_again(const TrackingModel& model, const Map& map, int min_inliers,
                   FrameLog& log) const;

 private:
  void drop_newest();
  void move_to_file();

  SparePages file_;
  bool imu_;
  std::deque<KeptFrame> frames_;     // by ascending index
  std::size_t in_file_ = 0;          // number of oldest ones whose keypoints are in the file
  std::size_t bytes_in_memory_ = 0;  // of the keypoints of the others
  int since_start_ = 0;              // number of frames since the newest map was started
};

}  // namespace stillmap
