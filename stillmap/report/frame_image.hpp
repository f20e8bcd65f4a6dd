// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/tracker.hpp"

namespace stillmap {

/// The frame with the results of tracking: moving regions tinted red; rejected keypoints as red
/// crosses, inliers of the pose as green circles, other keypoints as small yellow circles; masks
/// outlined, with class and confidence. 8UC3 BGR, size of the frame.
cv::Mat draw_frame(const TrackedFrame& tracked);

/// The frame in gray with the motion label of every keypoint: rejected ones as red crosses, the
/// others as circles from red (surely moving) over yellow (unknown) to green (surely static). A
/// line of text gives the counts.
cv::Mat draw_labels(const TrackedFrame& tracked);

}  // namespace stillmap
