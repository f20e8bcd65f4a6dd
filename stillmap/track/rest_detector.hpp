// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/pose_solver.hpp"
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracker_state.hpp"

#include <deque>
#include <optional>

namespace stillmap {

/// Recognizes a camera at rest, so that what moves before it does not move it: keypoints all over
/// the image are exactly where they were in an earlier frame. As long as they are, its pose is that
/// of the same earlier frame and does not drift.
class RestDetector {
 public:
  /// Returns the pose of a frame in the world of a local map if the camera is where it was in an
  /// earlier frame, with its accuracy; otherwise none.
  std::optional<PosePrior> pose(const TrackingModel& model, const Features& features,
                                const LocalMap& local_map);

  /// Returns whether the camera was at rest within the last three seconds: what covers the view
  /// since then may uncover the same.
  bool may_last(double timestamp) const;

  /// Adds a tracked frame. One that starts a map makes it forget the others.
  void add(const TrackedFrame& tracked);

 private:
  /// A frame with a pose relative to a keyframe.
  struct View {
    std::size_t index = 0;
    FeaturesPtr features;
    KeyframeId reference;
    Pose T_reference_camera;
  };

  std::optional<View> start_;  // the first frame of the map until there is a snapshot of it
  std::deque<View> earlier_;   // oldest first
  std::optional<View> rest_;   // where the camera was at rest last
  bool at_rest_ = false;       // in the frame of pose()
  std::optional<double> at_rest_until_;  // time of the newest tracked frame at rest [s]
};

enum class PoseComparison {
  kSame,     ///< Keypoints are found again at the same places.
  kOther,    ///< They are found again, and have moved.
  kUnknown,  ///< Too few are found again, or in too small a part of the image.
};

/// Returns whether two images with these features were taken from the same pose.
/// @param all_over  whether this must be seen in most of the image; false: somebody may cover much
PoseComparison compare_poses(const TrackingModel& model, const Features& a, const Features& b,
                             bool all_over);

}  // namespace stillmap
