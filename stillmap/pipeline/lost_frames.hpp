// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/frame_log.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <deque>

namespace stillmap {

/// Frames to be tracked again at the end of a run: those without a pose, those whose pose
/// contradicts the motion of the camera, those most of whose keypoints move, and the first ones of
/// each map, in which moving objects were not yet known. By then the map contains landmarks that
/// are known to be static and those that were made after the frame, and a frame can be tracked from
/// the frames that follow it.
class LostFrames {
 public:
  /// Keeps the keypoints and the motion evidence of such a frame without its images; others are
  /// ignored. Of too many frames the oldest are dropped.
  void add(const TrackedFrame& tracked);

  /// Tracks each frame in the map, starting between the poses of the frames before and after it or,
  /// at the ends of a longer gap, from the nearest pose. A pose is added to the log if the frame
  /// has none, or replaces that in the log if more landmarks agree with it.
  /// @param min_inliers minimum number of landmarks that agree with a pose
  void track_again(const TrackingModel& model, const Map& map, int min_inliers,
                   FrameLog& log) const;

 private:
  std::deque<FramePtr> frames_;  // by ascending index
  int since_start_ = 0;          // number of frames since the newest map was started
};

}  // namespace stillmap
