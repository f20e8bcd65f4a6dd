// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/motion_labels.hpp"
#include "stillmap/motion/frame.hpp"

namespace stillmap {

/// Returns the motion labels of a frame's keypoints, in the form that the evaluation reads.
LabeledFrame labeled_frame(const Frame& frame);

}  // namespace stillmap
