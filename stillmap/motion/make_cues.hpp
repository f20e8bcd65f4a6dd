// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <memory>
#include <vector>

namespace stillmap {

struct MotionOptions;

using MotionCues = std::vector<std::unique_ptr<MotionCue>>;

/// Returns the cues named in options.cues, in that order and with their options. Throws Error for
/// an unknown name.
MotionCues make_cues(const MotionOptions& options);

/// Returns whether any cue uses detected objects, from a network or a folder of masks.
bool use_instances(const MotionCues& cues);

}  // namespace stillmap
