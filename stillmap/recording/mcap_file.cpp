// SPDX-License-Identifier: Apache-2.0
// MCAP files (https://mcap.dev/spec): a magic, then records of an operation code, a length and
// data.
#include "stillmap/base/error.hpp"
#include "stillmap/recording/recording_file.hpp"

#include <libdeflate.h>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::string_view kMagic = "\x89MCAP0\r\n";
constexpr std::size_t kRecordHeader = 9;    // operation code and length [bytes]
constexpr std::size_t kMessageHeader = 22;  // channel, sequence and two times [bytes]
constexpr std::size_t kChunkHeader = 32;    // up to the length of the compression's name [bytes]
// Maximum size of a schema or channel [bytes].
constexpr std::uint64_t kLargestDescription = 1 << 24;

enum Operation : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kDataEnd = 0x0f
};

struct Record {
  std::uint8_t operation = 0;
  std::uint64_t data = 0, size = 0;  // position and size of the data [bytes]
};

class McapFile : public ChunkedFile {
 public:
  McapFile(const std::filesystem::path& path, const RecordingContents* known) : ChunkedFile(path) {
    if (known != nullptr) {
      set_contents(*known);
      return;
    }
    ByteSource source(file(), 0, file().size());
    if (ByteCursor::as_text(source.at(0, kMagic.size())) != kMagic)
      throw Error("is not an MCAP file", path.string(), "give a file of MCAP's version 0");
    scan(source, kMagic.size(), 0);
    set_index(builder_.take());
  }

 private:
  // Scans records from a position to the end of the source, or to the end of the messages.
  void scan(ByteSource& source, std::uint64_t position, std::uint32_t block) {
    while (position < source.end()) {
      const ByteSpan header = source.at(position, kRecordHeader);
      if (header.size() < kRecordHeader) return truncated(block);
      ByteCursor cursor(header);
      Record record{.operation = cursor.get<std::uint8_t>(), .data = position + kRecordHeader};
      record.size = cursor.get<std::uint64_t>();
      if (record.operation == kDataEnd || record.operation == kFooter) return;
      const bool complete = record.size <= source.end() - record.data;
      if (record.operation == kChunk && block == 0 && !inside_chunk_) {
        scan_chunk(source, record);
      } else if (complete) {
        add(source, record, block);
      }
      if (!complete) return truncated(block);
      position = record.data + record.size;
    }
  }
  // The end of an incomplete chunk is part of the chunk's own problem.
  void truncated(std::uint32_t block) {
    if (block == 0) builder_.add_problem("the file is truncated: it ends within a record");
  }

  void add(ByteSource& source, const Record& record, std::uint32_t block) {
    try {
      switch (record.operation) {
        case kSchema:
          return add_schema(description(source, record));
        case kChannel:
          return add_channel(description(source, record));
        case kMessage:
          return add_message(source, record, block);
        default:
          return;
      }
    } catch (const Error&) {
      builder_.add_problem("a record is damaged");
    }
  }

  static ByteCursor description(ByteSource& source, const Record& record) {
    if (record.size > kLargestDescription) throw Error("a description is too large", "", "");
    return ByteCursor(source.at(record.data, record.size));
  }
  void add_schema(ByteCursor cursor) {
    const auto id = cursor.get<std::uint16_t>();
    types_[id] = cursor.text();
  }
  void add_channel(ByteCursor cursor) {
    const auto id = cursor.get<std::uint16_t>();
    const std::string& type = types_[cursor.get<std::uint16_t>()];
    const std::string_view name = cursor.text(), encoding = cursor.text();
    topics_[id] = builder_.add_topic(name, type, encoding);
  }
  void add_message(ByteSource& source, const Record& record, std::uint32_t block) {
    const ByteSpan start =
        source.at(record.data, std::min<std::uint64_t>(record.size, kMessageHeader + 12));
    ByteCursor cursor(start);
    const auto topic = topics_.find(cursor.get<std::uint16_t>());
    cursor.get<std::uint32_t>();  // sequence number
    const auto time = cursor.get<std::uint64_t>();
    cursor.get<std::uint64_t>();  // time of publication
    if (topic == topics_.end()) return builder_.add_problem("a message belongs to no topic");
    builder_.add_message({.log_time = static_cast<std::int64_t>(time),
                          .topic = topic->second,
                          .block = block,
                          .offset = record.data + kMessageHeader,
                          .size = record.size - kMessageHeader},
                         start.subspan(kMessageHeader));
  }

  void scan_chunk(ByteSource& source, const Record& record) {
    // First and last time, decompressed size, checksum, name of the compression, size of the data.
    const auto wanted = std::min<std::uint64_t>(record.size, kChunkHeader + 16);
    ByteCursor cursor(source.at(record.data, wanted));
    try {
      cursor.take(16);
      RecordingChunk chunk;
      chunk.declared = cursor.get<std::uint64_t>();
      const auto checksum = cursor.get<std::uint32_t>();
      const auto compression = compression_of(cursor.text());
      chunk.size = cursor.get<std::uint64_t>();
      chunk.offset = record.data + cursor.position();
      if (!compression || compression == Compression::kBzip2)
        return builder_.add_problem("a chunk has an unknown compression");
      if (chunk.size > record.size - cursor.position())
        return builder_.add_problem("a chunk is damaged: messages are missing");
      chunk.compression = *compression;
      if (compression == Compression::kNone) return scan_plain(chunk);
      scan_compressed(chunk, checksum);
    } catch (const Error& error) {
      if (record.size > source.end() - record.data) return;  // The file ends within the chunk.
      builder_.add_problem("a chunk is not read: " + error.problem());
    }
  }
  // The records of a chunk without compression are read from the file directly.
  void scan_plain(const RecordingChunk& chunk) {
    inside_chunk_ = true;
    ByteSource source(file(), chunk.offset, chunk.offset + chunk.size);
    scan(source, chunk.offset, 0);
    inside_chunk_ = false;
  }
  void scan_compressed(const RecordingChunk& chunk, std::uint32_t checksum) {
    const Decompressed result = load(chunk);
    const bool cut = chunk.offset + chunk.size > file().size();
    if (!result.complete && !cut) builder_.add_problem("a chunk is damaged: messages are missing");
    if (result.complete && checksum != 0 &&
        libdeflate_crc32(0, result.bytes.data(), result.bytes.size()) != checksum) {
      return builder_.add_problem("a chunk has a wrong checksum and is not read");
    }
    ByteSource source(result.bytes);
    scan(source, 0, add_chunk(chunk));
  }

  IndexBuilder builder_;
  std::unordered_map<std::uint16_t, std::string> types_;     // by schema
  std::unordered_map<std::uint16_t, std::uint32_t> topics_;  // by channel
  bool inside_chunk_ = false;
};

}  // namespace

std::unique_ptr<RecordingFile> open_mcap_file(const std::filesystem::path& path,
                                              const RecordingContents* known) {
  return std::make_unique<McapFile>(path, known);
}

}  // namespace stillmap
