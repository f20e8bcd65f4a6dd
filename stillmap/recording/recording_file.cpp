// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/recording_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/recording/contents_cache.hpp"
#include "stillmap/recording/decompressed_file.hpp"
#include "stillmap/recording/name_text.hpp"

#include <algorithm>
#include <set>
#include <zstd.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kNanoseconds = 1'000'000'000;  // of a second
// Marks the stamp of a message that must be decompressed first.
constexpr std::int64_t kUnknownStamp = -1;

bool has_header(const std::string& type) {
  return type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage" ||
         type == "sensor_msgs/CameraInfo" || type == "sensor_msgs/Imu" ||
         type == "nav_msgs/Odometry";
}

bool starts_with_zstd(ByteSpan bytes) {
  constexpr std::array<std::uint8_t, 4> magic{0x28, 0xb5, 0x2f, 0xfd};
  return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
}

std::uint32_t number_at(ByteSpan bytes, std::size_t at, bool big_endian) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value |= static_cast<std::uint32_t>(bytes[at + (big_endian ? 3 - i : i)]) << (8 * i);
  return value;
}

// Seconds and nanoseconds follow after four bytes: the sequence number of a ROS 1 header, or the
// encapsulation header of CDR, whose second byte is even for big-endian numbers.
std::int64_t stamp_in(ByteSpan start, const std::string& encoding) {
  if (start.size() < 12) return 0;
  const bool cdr = encoding == "cdr";
  if (cdr && starts_with_zstd(start)) return kUnknownStamp;
  const bool big_endian = cdr && start[1] % 2 == 0;
  const auto seconds = number_at(start, 4, big_endian);
  const auto nanoseconds = number_at(start, 8, big_endian);
  return seconds * kNanoseconds + nanoseconds;
}

// "sensor_msgs/msg/Image" is the name of "sensor_msgs/Image" in ROS 2.
std::string without_msg(std::string_view type) {
  std::string name(type);
  const auto at = name.find("/msg/");
  if (at != std::string::npos) name.erase(at, 4);
  return name;
}

}  // namespace

bool is_read_type(const std::string& type) {
  static const std::set<std::string> kTypes{
      "sensor_msgs/Image", "sensor_msgs/CompressedImage", "sensor_msgs/CameraInfo",
      "sensor_msgs/Imu",   "nav_msgs/Odometry",           "tf2_msgs/TFMessage",
      "tf/tfMessage",      "geometry_msgs/Transform",     "std_msgs/Float32",
      "std_msgs/String",   "diagnostic_msgs/KeyValue"};
  return kTypes.contains(type);
}

// ---- index
// ---------------------------------------------------------------------------------------

std::uint32_t IndexBuilder::add_topic(std::string_view name, std::string_view type,
                                      std::string_view encoding) {
  const auto id = static_cast<std::uint32_t>(index_.topics.size());
  const auto [found, added] = topic_ids_.emplace(std::string(name), id);
  if (added) {
    Topic topic;
    topic.name = name;
    topic.type = without_msg(type);
    topic.encoding = encoding;
    index_.topics.push_back(std::move(topic));
    listed_.push_back(is_read_type(index_.topics.back().type) &&
                      (encoding == "ros1" || encoding == "cdr"));
  }
  return found->second;
}

void IndexBuilder::add_message(MessageEntry entry, ByteSpan start) {
  Topic& topic = index_.topics[entry.topic];
  if (topic.messages++ == 0) topic.first_time = topic.last_time = entry.log_time;
  topic.first_time = std::min(topic.first_time, entry.log_time);
  topic.last_time = std::max(topic.last_time, entry.log_time);
  if (!listed_[entry.topic]) return;
  if (has_header(topic.type)) entry.stamp = stamp_in(start, topic.encoding);
  index_.messages.push_back(entry);
}

RecordingIndex IndexBuilder::take() {
  for (const auto& [problem, count] : problems_) {
    index_.warnings.push_back(count == 1 ? problem : fmt::format("{} ({} times)", problem, count));
  }
  return std::move(index_);
}

// ---- reading
// -------------------------------------------------------------------------------------

void RecordingFile::set_index(RecordingIndex index) {
  contents_.index = std::move(index);
  std::size_t damaged = 0;
  std::erase_if(contents_.index.messages, [&](MessageEntry& entry) {
    if (entry.stamp != kUnknownStamp) return false;
    try {
      entry.stamp = stamp_in(read(entry), "cdr");
      return false;
    } catch (const Error&) {
      ++damaged;
      return true;
    }
  });
  if (damaged > 0)
    contents_.index.warnings.push_back(fmt::format("{} compressed messages are damaged", damaged));
}

ByteSpan RecordingFile::read(const MessageEntry& entry) {
  const ByteSpan bytes = stored(entry);
  if (index().topics[entry.topic].encoding != "cdr" || !starts_with_zstd(bytes)) return bytes;
  const auto size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    throw Error("a compressed message does not declare its size", "", "");
  Decompressed result = decompress(Compression::kZstd, bytes, size);
  if (!result.complete) throw Error("a compressed message is damaged", "", "");
  decompressed_ = std::move(result.bytes);
  return decompressed_;
}

Decompressed ChunkedFile::load(const RecordingChunk& chunk) const {
  const std::uint64_t available =
      chunk.offset < file_.size() ? std::min(chunk.size, file_.size() - chunk.offset) : 0;
  if (available > kLargestChunk) throw Error("a chunk is too large", file_.path().string(), "");
  std::vector<std::uint8_t> compressed(available);
  compressed.resize(file_.read(chunk.offset, compressed));
  Decompressed result = decompress(chunk.compression, compressed, chunk.declared);
  result.complete = result.complete && compressed.size() == chunk.size;
  return result;
}

std::uint32_t RecordingFile::add_chunk(const RecordingChunk& chunk) {
  contents_.chunks.push_back(chunk);
  return static_cast<std::uint32_t>(contents_.chunks.size());
}

const std::vector<std::uint8_t>& ChunkedFile::chunk_bytes(std::uint32_t block) {
  if (cache_[0].block != block) {
    std::swap(cache_[0], cache_[1]);
    if (cache_[0].block != block) cache_[0] = {block, load(contents().chunks[block - 1]).bytes};
  }
  return cache_[0].bytes;
}

ByteSpan ChunkedFile::stored(const MessageEntry& entry) {
  if (entry.block != 0) {
    ByteCursor cursor(chunk_bytes(entry.block));
    cursor.take(entry.offset);
    return cursor.take(entry.size);
  }
  if (entry.size > kLargestChunk) throw Error("a message is too large", file_.path().string(), "");
  message_.resize(entry.size);
  if (file_.read(entry.offset, message_) != entry.size)
    throw Error("the file was truncated while it was read", file_.path().string(), "");
  return message_;
}

namespace {

// Returns the first bytes of a file.
std::vector<std::uint8_t> start_of(const fs::path& path) {
  std::vector<std::uint8_t> start(16);
  start.resize(InputFile(path).read(0, start));
  return start;
}

std::unique_ptr<RecordingFile> open_file(const fs::path& path, const RecordingContents* known);

// The decompressed file is removed on return; it stays readable, since it is open.
std::unique_ptr<RecordingFile> open_compressed_file(const fs::path& path,
                                                    const RecordingContents* known) {
  const DecompressedFile file(path);
  if (starts_with_zstd(start_of(file.path())))
    throw Error("is compressed twice", path.string(), "decompress it first: unzstd FILE");
  try {
    return open_file(file.path(), known);
  } catch (const Error& error) {
    throw Error("is compressed, and its content " + error.problem(), path.string(), error.fix());
  }
}

/// Returns how a file of another kind becomes a recording, by its extension.
std::string conversion_of(const fs::path& path) {
  const std::string extension = lower(path.extension().string());
  if (extension == ".gz") return "unpack it with gunzip";
  if (contains_any(extension, {".zip", ".tar", ".tgz", ".7z"}))
    return "unpack it and give the folder";
  if (contains_any(extension, {".yaml", ".txt", ".json", ".csv"}))
    return "give the folder that contains it";
  if (contains_any(extension, {".svo", ".mkv", ".r3d"}))
    return "convert it as described in docs/cameras.md";
  if (contains_any(extension, {".mp4", ".avi", ".mov"}))
    return "give a recording with depth; a color video alone cannot be mapped";
  return "give a recorded file, or a folder with color and depth images";
}

std::unique_ptr<RecordingFile> open_file(const fs::path& path, const RecordingContents* known) {
  const std::vector<std::uint8_t> start = start_of(path);
  const std::string_view magic = ByteCursor::as_text(start);
  if (magic.starts_with("#ROSBAG V2.0")) return open_bag_file(path, known);
  if (magic.starts_with("SQLite format 3")) return open_sqlite_file(path, known);
  if (magic.starts_with("\x89MCAP")) return open_mcap_file(path, known);
  if (starts_with_zstd(start)) return open_compressed_file(path, known);
  if (magic.starts_with("#ROSBAG")) {
    throw Error("is a bag of a version before 2.0", path.string(),
                "convert it with `rosbag fix` of ROS 1");
  }
  throw Error("is not a recording: neither a ROS 1 bag nor a db3 or mcap file of ROS 2",
              path.string(), conversion_of(path));
}

}  // namespace

std::unique_ptr<RecordingFile> open_recording_file(const fs::path& path) {
  const auto version = version_of(path);
  if (!version) return open_file(path, nullptr);
  if (const auto known = known_contents(*version)) return open_file(path, known.get());
  auto file = open_file(path, nullptr);
  keep_contents(*version, file->contents());
  return file;
}

}  // namespace stillmap
