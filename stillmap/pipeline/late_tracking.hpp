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

/// Tracks frames again in the map at the end of a run. By then its landmarks are more accurate, it
/// contains those that were made after a frame and none that move, and a frame can be tracked from
/// the frames that follow it.
class LateTracking {
 public:
  /// @param memory  for the keypoints of the frames; further ones are in a temporary file
  explicit LateTracking(MemoryLimit memory)
      : file_(std::move(memory), "the frames to be tracked again") {}

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
  struct Kept {
    FramePtr frame;
    bool reliable = false;
    std::shared_ptr<const Pages> pages = nullptr;  // of the keypoints; null: they are in memory
  };

  void drop_newest();
  void move_to_file();

  SparePages file_;
  std::deque<Kept> frames_;          // by ascending index
  std::size_t in_file_ = 0;          // number of oldest ones whose keypoints are in the file
  std::size_t bytes_in_memory_ = 0;  // of the keypoints of the others
  int since_start_ = 0;              // number of frames since the newest map was started
};

}  // namespace stillmap
