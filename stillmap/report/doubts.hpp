// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/run_record.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Returns whether the paper of a preset uses masks, so that the boxes of a network are not enough.
bool needs_masks(const std::string& preset);

/// Returns whether the paper of a preset uses a network's boxes or masks.
bool needs_detector(const std::string& preset);

/// Returns the reasons not to trust the results of a run, each as one sentence with its fix: few
/// frames with a pose, many unusable frames, unconnected maps, an empty dense map, many uncertain
/// poses, frames without masks, a network without masks for a preset that needs them, wrong
/// timestamps or depths. Empty if there are none.
std::vector<std::string> doubts_of(const RunRecord& record);

/// Returns a note with the fix if more than a fifth of the frames was dropped because they came too
/// fast; none otherwise, and if the coverage is so low that it is a doubt.
std::optional<std::string> note_on_late_frames(const RunRecord& record);

}  // namespace stillmap
