// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/motion_labels.hpp"
#include "stillmap/motion/frame.hpp"

namespace stillmap {

/// The labels on a frame's keypoints, as the evaluation takes them.
LabeledFrame labeled_frame(const Frame& frame);

}  // namespace stillmap
