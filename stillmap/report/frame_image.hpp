// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/tracker.hpp"

namespace stillmap {

/// Draws the frame with the results of tracking: moving regions tinted red; keypoints labeled as
/// moving as red crosses, inliers of the pose as green circles, other keypoints as small yellow
/// circles; masks outlined, with class and confidence. Returns 8UC3 BGR of the frame's size.
cv::Mat draw_frame(const TrackedFrame& tracked);

/// Draws the frame in gray with the motion label of every keypoint: moving ones as red crosses, the
/// others as circles from red (surely moving) over yellow (unknown) to green (surely static). A
/// line of text gives the counts.
cv::Mat draw_labels(const TrackedFrame& tracked);

}  // namespace stillmap
