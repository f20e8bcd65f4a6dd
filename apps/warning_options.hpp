// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/warn/rules.hpp"

#include <vector>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Adds --hook-offset.
CLI::Option* add_hook_offset(CLI::App& command, std::vector<double>& offset);

/// Returns the point "hook" of --hook-offset in the camera frame; none without the option.
NamedPoints hook_at(const std::vector<double>& offset);

}  // namespace stillmap
