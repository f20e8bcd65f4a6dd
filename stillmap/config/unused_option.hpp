// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"

#include <optional>
#include <string>

namespace stillmap {

/// Returns why an option has no effect beside the other ones, such as "there is no network; name
/// one with --model"; none if it has one.
/// @param path  "group.name"
std::optional<std::string> why_unused(const std::string& path, const Options& options);

}  // namespace stillmap
