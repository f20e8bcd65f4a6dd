// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// How many keypoints the next frame may have where time is real: as many as are wanted while the
/// tracker keeps up with the camera, fewer while it does not, and more again once it does, or once
/// few landmarks are left to hold on to (things that move may have most of the keypoints): a frame
/// dropped costs less than a track lost.
class KeypointBudget {
 public:
  /// @param most   keypoints wanted where there is time
  /// @param least  share of them that is never gone below
  explicit KeypointBudget(int most, double least = 0.4);

  /// A frame kept the tracker busy for so long, it came so much later than the one before [ms], and
  /// so many landmarks agreed on its pose.
  void took(double milliseconds, double interval, int landmarks);

  int keypoints() const;

 private:
  int most_;
  double least_;
  double share_ = 1;  // of most_
  double load_ = 0;   // of the interval, smoothed
};

}  // namespace stillmap
