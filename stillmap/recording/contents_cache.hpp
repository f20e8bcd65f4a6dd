// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/recording_file.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

namespace stillmap {

/// Tells versions of a file apart without reading it.
struct FileVersion {
  std::filesystem::path file;  ///< Canonical path.
  std::uintmax_t size = 0;     ///< [bytes]
  std::filesystem::file_time_type changed{};
  bool operator==(const FileVersion&) const = default;
};

/// Returns the version of a file; none if it may change without a new version: one that was changed
/// less than two seconds ago, or a database with a log.
std::optional<FileVersion> version_of(const std::filesystem::path& file);

/// Returns what keep_contents() kept of this version in this process; null if there is nothing.
std::shared_ptr<const RecordingContents> known_contents(const FileVersion& version);

/// Keeps the contents of a file that was scanned, for the next time that it is opened. Any thread
/// may call it.
void keep_contents(const FileVersion& version, const RecordingContents& contents);

}  // namespace stillmap
