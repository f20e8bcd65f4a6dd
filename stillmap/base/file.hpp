// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <string_view>

namespace stillmap {

/// Larger files are not read as text: the lists and tables of a day's recording are smaller
/// [bytes].
inline constexpr std::uintmax_t kLargestText = std::uintmax_t{256} << 20;
/// Limit of read_file() for files whose format has no largest size.
inline constexpr std::uintmax_t kAnySize = std::numeric_limits<std::uintmax_t>::max();

/// Returns whether there is a regular file of this name that may be looked up.
bool is_file(const std::filesystem::path& path);

/// Opens a file for reading. Throws Error if it cannot be read, or is a pipe or device.
std::ifstream open_file(const std::filesystem::path& file);

/// Returns the content of a file. Throws Error if it cannot be read, and before memory is taken if
/// it is a pipe or device, or has more than `largest` bytes.
std::string read_file(const std::filesystem::path& file, std::uintmax_t largest = kLargestText);

/// Writes a file atomically: to a temporary name in the same folder, then renamed, so readers see
/// the old or the new content, never a part. Throws Error (folder missing, not writable, disk
/// full).
void write_file(const std::filesystem::path& file, std::string_view content);
/// As above, with the content that `write` writes; it may move in the stream, which is at its
/// beginning.
void write_file(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write);

/// Creates a folder for results and checks that it is writable. Throws Error.
void make_output_folder(const std::filesystem::path& folder);

}  // namespace stillmap
