// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/verdicts.hpp"
#include "stillmap/motion/frame.hpp"

namespace stillmap {

/// The verdicts on a frame's keypoints, as the evaluation takes them.
VerdictFrame verdict_frame(const Frame& frame);

}  // namespace stillmap
