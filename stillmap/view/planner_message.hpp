// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Returns the floor, the grid and the static obstacles that a run with --planner wrote into its
/// folder: type "planner"; docs/view.md has its format. None without these files, and if the run
/// found no floor. Throws Error if a file is damaged.
std::optional<nlohmann::json> planner_message(const std::filesystem::path& run);

}  // namespace stillmap
