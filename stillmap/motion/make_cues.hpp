// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <memory>
#include <vector>

namespace stillmap {

struct MotionOptions;

using MotionCues = std::vector<std::unique_ptr<MotionCue>>;

/// The cues that options.cues names, in that order and with their options. Throws Error for an
/// unknown name.
MotionCues make_cues(const MotionOptions& options);

/// Whether any cue looks at detected objects, so that a network or a folder of masks is of use.
bool use_instances(const MotionCues& cues);

}  // namespace stillmap
