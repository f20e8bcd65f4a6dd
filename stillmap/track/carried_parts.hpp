// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracked_frame.hpp"

#include <optional>

namespace stillmap {

/// Detects poses that follow parts of the images that the camera carries along: the robot's own
/// body, or the pattern of an infrared projector. Their keypoints stay at the same pixels while the
/// scene moves.
///
/// The other keypoints then agree on a motion that contradicts the tracked one. The depth images
/// decide between the two: if the camera moves, the surfaces of the scene follow that motion, and
/// only the robot's surfaces, which are nearer, stay at their pixels; if the camera rests in front
/// of movers, the surfaces behind and beside them stay at their pixels.
class CarriedParts {
 public:
  /// Adds the next frame. Every fifth frame is compared with the one five frames before.
  void add(const TrackingModel& model, const TrackedFramePtr& tracked);

  /// Returns the finding that the poses follow carried parts; none if they do not.
  std::optional<Finding> finding() const;

 private:
  TrackedFramePtr earlier_;        // null: the next frame is the first to be compared
  int frames_ = 0;                 // number of frames since `earlier_`
  int carried_ = 0, resting_ = 0;  // number of pairs of frames that show one or the other
};

}  // namespace stillmap
