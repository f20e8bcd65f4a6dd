// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"
#include "stillmap/motion/frame.hpp"

#include <vector>

namespace stillmap {

/// Visibility statistics of a landmark, counted by the tracker.
struct VisibilityCount {
  LandmarkId landmark;
  std::uint32_t predicted = 0, found = 0;
  float static_log_odds = 0;  ///< Static log-odds after all frames so far.
};

/// Request of the tracker to the mapper: make this frame a keyframe.
struct KeyframeProposal {
  FramePtr frame;
  /// Keyframe that the pose is relative to; invalid for the first keyframe of a new component,
  /// whose pose is given in the world frame.
  KeyframeId reference;
  Pose T_reference_camera;
  /// One per keypoint: the landmark that it shows, or an invalid id.
  std::vector<LandmarkId> landmarks;
  /// Counts since the previous proposal; a landmark may appear several times.
  std::vector<VisibilityCount> visibility_counts;
  /// Landmarks to be erased, since they repeat landmarks observed by the frame.
  std::vector<LandmarkId> repeated = {};
  /// For the first keyframe of a new component: a keyframe of the previous component if that one
  /// tracked the camera too briefly to be kept; otherwise invalid.
  KeyframeId abandoned = {};
  /// For the first keyframe of a new component: a keyframe of the component that it replaces, which
  /// was made before the velocity of the camera was known or from moving objects; otherwise
  /// invalid.
  KeyframeId replaced = {};
  /// Whether the frame shows a part of the component that was not seen before: see Tracker.
  bool unseen = false;

  /// Returns whether none of the landmarks is in view: a component or an unseen part starts.
  bool starts_part() const { return unseen || !reference.valid(); }
};

}  // namespace stillmap
