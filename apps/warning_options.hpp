// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/warn/rules.hpp"

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Adds --events.
CLI::Option* add_events_option(CLI::App& command, std::string& events);

/// Adds --hook-offset.
CLI::Option* add_hook_offset(CLI::App& command, std::vector<double>& offset);

/// Returns the point "hook" of --hook-offset in the camera frame; none without the option. Throws
/// Error for a place that is not finite or farther than 1 km.
NamedPoints hook_at(const std::vector<double>& offset);

}  // namespace stillmap
