// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/byte_cursor.hpp"
#include "stillmap/recording/decompress.hpp"
#include "stillmap/recording/input_file.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace stillmap {

/// A topic of a recording.
struct Topic {
  std::string name;
  std::string type;      ///< ROS type without `msg/`: "sensor_msgs/Image".
  std::string encoding;  ///< "ros1", "cdr", or another one, which is listed but not read.
  std::uint64_t messages = 0;
  std::int64_t first_time = 0, last_time = 0;  ///< Time of recording of its messages [ns].
};

/// Place and times of one message.
struct MessageEntry {
  std::int64_t log_time = 0;  ///< Time of recording [ns].
  std::int64_t stamp = 0;     ///< Time in the message's header [ns]; 0 without a header.
  std::uint32_t topic = 0;    ///< Index of its topic.
  std::uint32_t file = 0;     ///< Index of its file, in a recording of several files.
  std::uint32_t block = 0;    ///< 0: in the file itself; i + 1: in the decompressed chunk i.
  std::uint64_t offset = 0;   ///< Position in the file or chunk [bytes]; row of a database.
  std::uint64_t size = 0;     ///< [bytes]
};

/// What a file contains.
struct RecordingIndex {
  std::vector<Topic> topics;
  /// Messages of the types that Stillmap reads (is_read_type()), in the order of the file.
  std::vector<MessageEntry> messages;
  /// One sentence for each kind of damage that was found, with the number of its occurrences.
  std::vector<std::string> warnings;
};

/// A chunk of a file, whose bytes may be compressed.
struct RecordingChunk {
  std::uint64_t offset = 0, size = 0;  ///< Of the compressed bytes in the file.
  std::uint64_t declared = 0;          ///< Size of the decompressed bytes.
  Compression compression = Compression::kNone;
};

/// What a scan finds in a file.
struct RecordingContents {
  RecordingIndex index;
  std::vector<RecordingChunk> chunks;
};

/// Returns whether the messages of a type are listed in RecordingIndex::messages: images, cameras,
/// inertial measurements, transforms, and the texts and numbers of RealSense recordings.
bool is_read_type(const std::string& type);

/// Collects the index of a file while it is scanned.
class IndexBuilder {
 public:
  /// Adds a topic, or finds the one of this name; returns its index.
  std::uint32_t add_topic(std::string_view name, std::string_view type, std::string_view encoding);
  /// Counts a message, and lists it if its type is read.
  /// @param start  the first bytes of the message, 12 or more if it has as many
  void add_message(MessageEntry entry, ByteSpan start);
  /// Counts a kind of damage.
  void add_problem(const std::string& problem) { ++problems_[problem]; }
  /// Returns whether a message of this topic is listed.
  bool lists(std::uint32_t topic) const { return listed_[topic]; }
  /// Returns the index, and leaves the builder empty.
  RecordingIndex take();

 private:
  RecordingIndex index_;
  std::vector<bool> listed_;
  std::unordered_map<std::string, std::uint32_t> topic_ids_;
  std::map<std::string, int> problems_;
};

/// A file of messages: a ROS 1 bag, an SQLite file of rosbag2, or an MCAP file. The whole file is
/// scanned when it is opened for the first time; no index in the file is needed or trusted. One
/// thread at a time.
class RecordingFile {
 public:
  virtual ~RecordingFile() = default;
  const RecordingIndex& index() const { return contents_.index; }
  const RecordingContents& contents() const { return contents_; }
  /// Returns the bytes of a message, valid until the next call. Throws Error if they cannot be
  /// read.
  ByteSpan read(const MessageEntry& entry);

 protected:
  virtual ByteSpan stored(const MessageEntry& entry) = 0;
  /// Takes the index, and adds the stamps of messages that rosbag2 compressed one by one.
  void set_index(RecordingIndex index);
  /// Takes the contents that an earlier scan of this file found.
  void set_contents(const RecordingContents& contents) { contents_ = contents; }
  /// Returns the number by which messages name a chunk: see MessageEntry::block.
  std::uint32_t add_chunk(const RecordingChunk& chunk);

 private:
  RecordingContents contents_;
  std::vector<std::uint8_t> decompressed_;
};

/// A file whose messages lie in chunks, which may be compressed.
class ChunkedFile : public RecordingFile {
 public:
  explicit ChunkedFile(const std::filesystem::path& path) : file_(path) {}

 protected:
  const InputFile& file() const { return file_; }
  ByteSpan stored(const MessageEntry& entry) override;
  /// Decompresses a chunk; incomplete if it is damaged, or if the file ends within it.
  Decompressed load(const RecordingChunk& chunk) const;

 private:
  struct Cached {
    std::uint32_t block = 0;
    std::vector<std::uint8_t> bytes;
  };
  const std::vector<std::uint8_t>& chunk_bytes(std::uint32_t block);

  InputFile file_;
  std::array<Cached, 2> cache_;  // Color and depth of a frame lie in one chunk, or in neighbors.
  std::vector<std::uint8_t> message_;
};

/// Opens a file and detects its format by its first bytes. A file that this process has scanned and
/// that did not change since is not scanned again. Throws Error if it is none of the three formats
/// or contains nothing readable.
std::unique_ptr<RecordingFile> open_recording_file(const std::filesystem::path& path);

/// The three formats. Each function throws Error if the file is not of its format.
/// @param known  contents of the file; null to scan it
std::unique_ptr<RecordingFile> open_bag_file(const std::filesystem::path& path,
                                             const RecordingContents* known);
std::unique_ptr<RecordingFile> open_sqlite_file(const std::filesystem::path& path,
                                                const RecordingContents* known);
std::unique_ptr<RecordingFile> open_mcap_file(const std::filesystem::path& path,
                                              const RecordingContents* known);

}  // namespace stillmap
