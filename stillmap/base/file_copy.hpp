// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace stillmap {

/// Writes a copy of a file, atomically as write_file(). Throws Error; an existing file then stays.
void write_copy(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace stillmap
