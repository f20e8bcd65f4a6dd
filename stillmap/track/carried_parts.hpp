// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracked_frame.hpp"

#include <string>

namespace stillmap {

/// Recognizes poses that rest on parts of the images that the camera carries along: the robot's own
/// body, or the pattern of an infrared projector. Their keypoints keep their pixels while the scene
/// moves.
///
/// The keypoints of two frames that change their pixels tell another motion than the tracked one,
/// and the depth images decide between both: if the camera moves, the surfaces of the scene follow
/// that motion, and only those of the robot, which are nearer, keep their pixels; if it rests in
/// front of movers, the surfaces behind and beside them keep their pixels.
class CarriedParts {
 public:
  /// Adds the next frame. Every fifth is compared with the one before.
  void add(const TrackingModel& model, const TrackedFramePtr& tracked);

  /// Returns the sentence for users that the poses follow carried parts, with the fix; empty if
  /// they do not.
  std::string doubt() const;

 private:
  TrackedFramePtr earlier_;        // null: the next frame is the first to be compared
  int frames_ = 0;                 // since `earlier_`
  int carried_ = 0, resting_ = 0;  // pairs of frames that show one or the other
};

}  // namespace stillmap
