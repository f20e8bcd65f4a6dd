// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags, format 2.0 (http://wiki.ros.org/Bags/Format/2.0): a text line, then records. A record
// is a header of named fields with its length, and data with its length.
#include "stillmap/base/error.hpp"
#include "stillmap/recording/recording_file.hpp"

#include <array>
#include <cstring>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
// Maximum size of a record's header and of a connection's description [bytes]. The message
// definitions in a description have some thousand.
constexpr std::uint32_t kLargestHeader = 1 << 16;
constexpr std::uint32_t kLargestConnection = 1 << 22;

enum Operation : std::uint8_t { kMessage = 0x02, kChunk = 0x05, kConnection = 0x07 };

/// Fields of a header that are used.
struct Fields {
  std::optional<std::uint8_t> operation;
  std::uint32_t connection = 0;
  std::int64_t time = 0;    // ns
  std::uint32_t size = 0;   // decompressed size of a chunk [bytes]
  std::string topic, type;  // of a connection
  std::string compression;  // of a chunk
};

template <typename T>
T number(std::string_view value) {
  T result{};
  if (value.size() == sizeof(T)) value.copy(reinterpret_cast<char*>(&result), sizeof(T));
  return result;
}

// Parses fields "name=value", each behind its length.
void parse_fields(ByteSpan bytes, Fields& fields) {
  ByteCursor cursor(bytes);
  while (cursor.left() > 0) {
    const std::string_view field = cursor.text();
    const auto equals = field.find('=');
    if (equals == std::string_view::npos) throw Error("a field has no name", "", "");
    const std::string_view name = field.substr(0, equals), value = field.substr(equals + 1);
    if (name == "op") fields.operation = number<std::uint8_t>(value);
    if (name == "conn") fields.connection = number<std::uint32_t>(value);
    if (name == "size") fields.size = number<std::uint32_t>(value);
    if (name == "topic") fields.topic = value;
    if (name == "type") fields.type = value;
    if (name == "compression") fields.compression = value;
    if (name == "time" && value.size() == 8) {
      fields.time = number<std::uint32_t>(value.substr(0, 4)) * std::int64_t{1'000'000'000} +
                    number<std::uint32_t>(value.substr(4));
    }
  }
}

class BagFile : public ChunkedFile {
 public:
  BagFile(const std::filesystem::path& path, const RecordingContents* known) : ChunkedFile(path) {
    if (known != nullptr) {
      set_contents(*known);
      return;
    }
    ByteSource source(file(), 0, file().size());
    if (ByteCursor::as_text(source.at(0, kMagic.size())) != kMagic)
      throw Error("is not a ROS 1 bag", path.string(), "give a file that `rosbag record` wrote");
    scan(source, kMagic.size(), 0);
    set_index(builder_.take());
  }

 private:
  struct Record {
    Fields fields;
    std::uint64_t data = 0;  // position of the data
    std::uint32_t size = 0;  // of the data [bytes]
  };

  // Returns the record at a position; none, after counting the damage, if there is no valid one.
  std::optional<Record> record_at(ByteSource& source, std::uint64_t position, std::uint32_t block) {
    const auto length = number<std::uint32_t>(ByteCursor::as_text(source.at(position, 4)));
    const bool length_there = source.end() - position >= 4;
    if (length_there && length > kLargestHeader) return damaged(position);
    const ByteSpan header = source.at(position + 4, length);
    if (!length_there || header.size() < length) return truncated(block);
    Record record;
    try {
      parse_fields(header, record.fields);
    } catch (const Error&) {
      return damaged(position);
    }
    if (!record.fields.operation) return damaged(position);
    const ByteSpan size = source.at(position + 4 + length, 4);
    if (size.size() < 4) return truncated(block);
    record.size = number<std::uint32_t>(ByteCursor::as_text(size));
    record.data = position + 8 + length;
    return record;
  }
  std::nullopt_t damaged(std::uint64_t position) {
    builder_.add_problem(
        fmt::format("the bag is damaged near byte {}: the rest is not read", position));
    return std::nullopt;
  }
  // The end of an incomplete chunk is part of the chunk's own problem.
  std::nullopt_t truncated(std::uint32_t block) {
    if (block == 0) builder_.add_problem("the bag is truncated: it ends within a record");
    return std::nullopt;
  }

  // Scans records from a position to the end of the source.
  void scan(ByteSource& source, std::uint64_t position, std::uint32_t block) {
    while (position < source.end()) {
      const auto record = record_at(source, position, block);
      if (!record) return;
      position = record->data + record->size;
      if (record->fields.operation == kChunk && block == 0) {
        scan_chunk(*record);
        continue;
      }
      if (position > source.end()) {
        truncated(block);
        return;
      }
      if (record->fields.operation == kConnection) add_connection(source, *record);
      if (record->fields.operation == kMessage) add_message(source, *record, block);
    }
  }

  void scan_chunk(const Record& record) {
    const auto compression = compression_of(record.fields.compression);
    if (!compression || compression == Compression::kZstd) {
      builder_.add_problem("a chunk has an unknown compression");
      return;
    }
    if (compression == Compression::kNone) {  // Its records are read from the file directly.
      if (inside_chunk_) return;
      inside_chunk_ = true;
      ByteSource source(file(), record.data, record.data + record.size);
      scan(source, record.data, 0);
      inside_chunk_ = false;
      return;
    }
    const RecordingChunk chunk{record.data, record.size, record.fields.size, *compression};
    try {
      const Decompressed result = load(chunk);
      const bool cut = record.data + record.size > file().size();
      if (!result.complete)
        builder_.add_problem(cut ? "the bag is truncated: it ends within a chunk"
                                 : "a chunk is damaged: messages are missing");
      ByteSource source(result.bytes);
      scan(source, 0, add_chunk(chunk));
    } catch (const Error& error) {
      builder_.add_problem("a chunk is not read: " + error.problem());
    }
  }

  void add_connection(ByteSource& source, const Record& record) {
    if (record.size > kLargestConnection) {
      builder_.add_problem("the description of a topic is damaged");
      return;
    }
    Fields fields;
    try {
      parse_fields(source.at(record.data, record.size), fields);
    } catch (const Error&) {
      builder_.add_problem("the description of a topic is damaged");
      return;
    }
    topics_.emplace(record.fields.connection,
                    builder_.add_topic(record.fields.topic, fields.type, "ros1"));
  }

  void add_message(ByteSource& source, const Record& record, std::uint32_t block) {
    const auto topic = topics_.find(record.fields.connection);
    if (topic == topics_.end()) {
      builder_.add_problem("a message belongs to no topic");
      return;
    }
    builder_.add_message({.log_time = record.fields.time,
                          .topic = topic->second,
                          .block = block,
                          .offset = record.data,
                          .size = record.size},
                         source.at(record.data, 12).first(std::min(12U, record.size)));
  }

  IndexBuilder builder_;
  std::unordered_map<std::uint32_t, std::uint32_t> topics_;  // by connection
  bool inside_chunk_ = false;
};

}  // namespace

std::unique_ptr<RecordingFile> open_bag_file(const std::filesystem::path& path,
                                             const RecordingContents* known) {
  return std::make_unique<BagFile>(path, known);
}

}  // namespace stillmap
