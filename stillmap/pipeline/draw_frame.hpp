// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/tracker.hpp"

namespace stillmap {

/// The frame as the tracker saw it: what is taken for moving tinted red; keypoints left out as red
/// crosses, those that agree with the map as green circles, the others as small yellow ones; masks
/// outlined, with class and age. 8UC3 BGR, the size of the frame.
cv::Mat draw_frame(const TrackedFrame& tracked);

/// The same with keypoints by label, on a grayed picture: those left out as red crosses, the
/// others as circles from red (surely moving) over yellow (nothing known) to green (surely
/// static); a line below says how many are which.
cv::Mat draw_labels(const TrackedFrame& tracked);

}  // namespace stillmap
