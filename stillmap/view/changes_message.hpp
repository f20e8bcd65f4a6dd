// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// The file by which a folder that `stillmap map changes` wrote is known.
constexpr const char* kChangesFile = "changes.json";

/// Returns the changes between two visits in the folder that `stillmap map changes` wrote: type
/// "changes"; protocol.md has its format. Throws Error if a file is missing or damaged.
nlohmann::json changes_message(const std::filesystem::path& folder);

}  // namespace stillmap
