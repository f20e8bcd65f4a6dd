// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace stillmap {

/// The whole of a file as bytes. Throws Error if it cannot be read.
std::string read_file(const std::filesystem::path& file);

/// Writes bytes under a temporary name beside `file`, then renames: readers see the old content or
/// the new, never half of it. Throws Error (folder missing, not writable, disk full).
void write_file(const std::filesystem::path& file, std::string_view content);

/// Creates a folder for results, and checks that it can be written to. Throws Error.
void make_output_folder(const std::filesystem::path& folder);

}  // namespace stillmap
