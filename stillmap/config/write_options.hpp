// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// All options by group and name, and the preset.
nlohmann::json options_json(const Options& options);

/// The reference of all options: the text of docs/options.md.
std::string options_markdown();

/// One line for each of presets(): name and description.
std::string presets_text();

}  // namespace stillmap
