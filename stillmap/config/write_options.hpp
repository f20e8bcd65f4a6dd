// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// First line of options_yaml().
constexpr const char* kOptionsFileTitle =
    "# The options of Stillmap: for stillmap run --config FILE.";

/// Returns all options by group and name, and the preset.
nlohmann::json options_json(const Options& options);

/// Returns the reference of all options, the text of docs/options.md.
std::string options_markdown();

/// Returns one line with name and description for each of presets().
std::string presets_text();

}  // namespace stillmap
