// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// Number of keypoints to extract from the next frame in the realtime schedule. The budget shrinks
/// while the tracker is slower than the camera, and grows again once it keeps up, or if few
/// landmarks are tracked (most keypoints may lie on moving objects): a dropped frame costs less
/// than a lost track.
class KeypointBudget {
 public:
  /// @param most   number of keypoints without load
  /// @param least  smallest share of `most` [0..1]
  explicit KeypointBudget(int most, double least = 0.4);

  /// Adds the load of one frame.
  /// @param milliseconds time of the tracker for the frame [ms]
  /// @param interval     time since the previous frame of the camera [ms]
  /// @param landmarks    number of landmarks that agree with its pose
  void add_frame(double milliseconds, double interval, int landmarks);

  /// Returns the number of keypoints for the next frame.
  int keypoints() const;

 private:
  int most_;
  double least_;
  double share_ = 1;  // current share of most_ [0..1]
  double load_ = 0;   // smoothed time of the tracker, relative to the camera's interval
};

}  // namespace stillmap
