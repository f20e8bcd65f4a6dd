// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdio>
#include <filesystem>
#include <string_view>

namespace stillmap {

/// Name that stands for standard output where a command takes the name of a file.
constexpr const char* kStandardOutput = "-";

/// Reserves standard output for data: what else this program prints goes to standard error from
/// now on. Returns the stream of the data, which stays open. Throws Error if it cannot be done.
std::FILE* standard_output_for_data();

/// Each function returns whether a file is of the kind that Stillmap writes.
bool is_options_file(const std::filesystem::path& file);
bool is_figures_file(const std::filesystem::path& file);
bool is_static_page(const std::filesystem::path& file);

/// Throws Error if the file exists and is not of the kind that would replace it, unless `force` is
/// set. For a check before a long computation.
void require_replaceable(const std::filesystem::path& file,
                         bool (*is_own)(const std::filesystem::path&), bool force);

/// Writes a file that the user named, and prints its name; "-" prints the text instead. Throws
/// Error as require_replaceable() does.
void write_named(const std::filesystem::path& file, std::string_view text,
                 bool (*is_own)(const std::filesystem::path&), bool force);

}  // namespace stillmap
