// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/recording_file.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A recording: one file, or a folder of rosbag2 with one or several files. One thread at a time.
class Recording {
 public:
  /// Throws Error if the file or folder is no recording.
  explicit Recording(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  const std::vector<Topic>& topics() const { return topics_; }
  /// Returns the listed messages of all files, in their order: see RecordingIndex.
  const std::vector<MessageEntry>& messages() const { return messages_; }
  /// Returns the listed messages of a topic.
  std::vector<MessageEntry> messages_of(std::uint32_t topic) const;
  std::optional<std::uint32_t> find_topic(const std::string& name) const;
  /// Returns one sentence for each kind of damage that was found, and for missing files.
  const std::vector<std::string>& warnings() const { return warnings_; }
  /// Returns the time from the first to the last message [s].
  double duration() const;

  /// Returns the bytes of a message, valid until the next call. Throws Error if they cannot be
  /// read.
  ByteSpan read(const MessageEntry& entry);

 private:
  void add(const std::filesystem::path& file);

  std::filesystem::path path_;
  std::vector<std::unique_ptr<RecordingFile>> files_;
  std::vector<std::vector<std::uint32_t>> local_topics_;  // per file: its index of each topic here
  std::vector<Topic> topics_;
  std::vector<MessageEntry> messages_;
  std::vector<std::string> warnings_;
};

/// Returns whether the path names a file, or a folder with files of rosbag2 (*.db3, *.mcap; also
/// compressed as a whole, *.zstd).
bool is_recording(const std::filesystem::path& path);

/// Returns a time in seconds, correctly rounded: the number that the same time has when it is read
/// from text with nine decimals.
double seconds_of(std::int64_t nanoseconds);

}  // namespace stillmap
