// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/warn/warning_monitor.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the frames of a run folder by time, with camera and movers as its files have them.
std::vector<WatchedFrame> watched_frames(const std::filesystem::path& run);

/// Returns the rules for a finished run: those of a file, or without one those that the run kept.
/// Throws Error if there are none, or if a rule is for a class that no mover of the run can have.
/// @param hook_offset  point "hook" in the camera frame [m]; empty: that of the file
WarningRules rules_for(const std::filesystem::path& run, const std::string& zones,
                       const std::vector<double>& hook_offset);

/// Returns the events of rules in a finished run.
std::vector<WarningEvent> replayed_events(const WarningRules& rules,
                                          const std::filesystem::path& run);

}  // namespace stillmap
