// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace stillmap {

/// Returns the content of a file. Throws Error if it cannot be read.
std::string read_file(const std::filesystem::path& file);

/// Writes a file atomically: to a temporary name in the same folder, then renamed, so readers see
/// the old or the new content, never a part. Throws Error (folder missing, not writable, disk
/// full).
void write_file(const std::filesystem::path& file, std::string_view content);

/// Creates a folder for results and checks that it is writable. Throws Error.
void make_output_folder(const std::filesystem::path& folder);

}  // namespace stillmap
