// SPDX-License-Identifier: Apache-2.0
// For tests: writers of the three containers and of messages, written by the formats' documents and
// without the readers' code.
#pragma once
#include "stillmap/base/test_path.hpp"

#include <algorithm>
#include <bit>
#include <bzlib.h>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <lz4frame.h>
#include <map>
#include <sqlite3.h>
#include <stdexcept>
#include <string>
#include <vector>
#include <zstd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace stillmap::test {

/// Appends fields in the encoding ros1, CDR little-endian or CDR big-endian.
class MessageWriter {
 public:
  enum class Kind { kRos1, kLittleCdr, kBigCdr };
  explicit MessageWriter(Kind kind) : kind_(kind) {
    if (kind == Kind::kLittleCdr) bytes_ = std::string("\0\1\0\0", 4);
    if (kind == Kind::kBigCdr) bytes_ = std::string("\0\0\0\0", 4);
  }
  template <typename T>
  MessageWriter& put(T value) {
    if (kind_ != Kind::kRos1)
      while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
    std::string text(reinterpret_cast<const char*>(&value), sizeof(T));
    if (kind_ == Kind::kBigCdr) std::reverse(text.begin(), text.end());
    bytes_ += text;
    return *this;
  }
  MessageWriter& text(const std::string& text) {
    const bool cdr = kind_ != Kind::kRos1;
    put(static_cast<std::uint32_t>(text.size() + (cdr ? 1 : 0)));
    bytes_ += text;
    if (cdr) bytes_ += '\0';
    return *this;
  }
  MessageWriter& data(const std::string& data) {
    put(static_cast<std::uint32_t>(data.size()));
    bytes_ += data;
    return *this;
  }
  MessageWriter& header(std::uint32_t seconds, std::uint32_t nanoseconds,
                        const std::string& frame) {
    if (kind_ == Kind::kRos1) put(std::uint32_t{3});
    return put(seconds).put(nanoseconds).text(frame);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  Kind kind_;
  std::string bytes_;
};

using Kind = MessageWriter::Kind;

struct TestMessage {
  std::string topic, type, data;
  std::int64_t time = 0;  // ns
};

inline std::string le(auto value) { return {reinterpret_cast<const char*>(&value), sizeof value}; }
inline std::string with_length32(const std::string& text) {
  return le(static_cast<std::uint32_t>(text.size())) + text;
}

inline std::string compressed(const std::string& name, const std::string& data) {
  if (name == "bz2") {
    std::string out(data.size() + data.size() / 100 + 600, '\0');
    auto size = static_cast<unsigned>(out.size());
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(data.data()),
                             static_cast<unsigned>(data.size()), 1, 0, 0);
    out.resize(size);
    return out;
  }
  if (name == "lz4") {
    std::string out(LZ4F_compressFrameBound(data.size(), nullptr), '\0');
    out.resize(LZ4F_compressFrame(out.data(), out.size(), data.data(), data.size(), nullptr));
    return out;
  }
  if (name == "zstd") {
    std::string out(ZSTD_compressBound(data.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), data.data(), data.size(), 1));
    return out;
  }
  return data;
}

/// A ROS 1 bag with `per_chunk` messages in a chunk.
inline std::string bag_of(const std::vector<TestMessage>& messages, const std::string& compression,
                          std::size_t per_chunk, bool index) {
  const auto field = [](const std::string& name, const std::string& value) {
    return with_length32(name + "=" + value);
  };
  const auto record = [](const std::string& header, const std::string& data) {
    return with_length32(header) + with_length32(data);
  };
  const auto time = [](std::int64_t ns) {
    return le(static_cast<std::uint32_t>(ns / 1000000000)) +
           le(static_cast<std::uint32_t>(ns % 1000000000));
  };
  std::string bag = "#ROSBAG V2.0\n";
  const std::string bag_header = field("op", "\x03") + field("index_pos", le(std::uint64_t{0})) +
                                 field("conn_count", le(std::uint32_t{0})) +
                                 field("chunk_count", le(std::uint32_t{0}));
  bag += record(bag_header, std::string(4096 - bag_header.size() - 8, ' '));
  std::map<std::string, std::uint32_t> connections;
  for (std::size_t begin = 0; begin < messages.size(); begin += per_chunk) {
    std::string chunk;
    for (std::size_t i = begin; i < std::min(messages.size(), begin + per_chunk); ++i) {
      const auto& [topic, type, data, stamp] = messages[i];
      const auto id = static_cast<std::uint32_t>(connections.size());
      const auto [found, added] = connections.emplace(topic, id);
      const std::string connection = field("conn", le(found->second));
      if (added) {
        chunk += record(connection + field("op", "\x07") + field("topic", topic),
                        field("topic", topic) + field("type", type) + field("md5sum", "*") +
                            field("message_definition", "no = sign\n"));
      }
      chunk += record(connection + field("op", "\x02") + field("time", time(stamp)), data);
    }
    bag += record(field("compression", compression) + field("op", "\x05") +
                      field("size", le(static_cast<std::uint32_t>(chunk.size()))),
                  compressed(compression, chunk));
    if (index) {
      bag += record(field("conn", le(std::uint32_t{0})) + field("count", le(std::uint32_t{0})) +
                        field("op", "\x04") + field("ver", le(std::uint32_t{1})),
                    "");
    }
  }
  return bag;
}

/// An MCAP file; with `per_chunk` = 0 without chunks.
inline std::string mcap_of(const std::vector<TestMessage>& messages, const std::string& encoding,
                           const std::string& compression, std::size_t per_chunk, bool summary) {
  const auto record = [](char operation, const std::string& data) {
    return operation + le(static_cast<std::uint64_t>(data.size())) + data;
  };
  const std::string magic("\x89MCAP0\r\n", 8);
  std::string file = magic + record('\x01', with_length32("") + with_length32("test"));
  std::map<std::string, std::uint16_t> channels;
  std::string descriptions, chunk;
  std::size_t in_chunk = 0;
  const auto flush = [&] {
    if (chunk.empty()) return;
    const std::string data = compressed(compression, chunk);
    file += record('\x06', le(std::uint64_t{0}) + le(std::uint64_t{0}) +
                               le(static_cast<std::uint64_t>(chunk.size())) + le(std::uint32_t{0}) +
                               with_length32(compression) +
                               le(static_cast<std::uint64_t>(data.size())) + data);
    file += record('\x07', le(std::uint16_t{1}) + le(std::uint32_t{0}));  // an index of nothing
    chunk.clear();
    in_chunk = 0;
  };
  for (const auto& [topic, type, data, stamp] : messages) {
    std::string& target = per_chunk > 0 ? chunk : file;
    const auto id = static_cast<std::uint16_t>(channels.size() + 1);
    const auto [found, added] = channels.emplace(topic, id);
    if (added) {
      const std::string description =
          record('\x03',
                 le(id) + with_length32(type) + with_length32("ros2msg") + with_length32("")) +
          record('\x04', le(id) + le(id) + with_length32(topic) + with_length32(encoding) +
                             le(std::uint32_t{0}));
      target += description;
      descriptions += description;
    }
    target += record('\x05', le(found->second) + le(std::uint32_t{0}) +
                                 le(static_cast<std::uint64_t>(stamp)) +
                                 le(static_cast<std::uint64_t>(stamp)) + data);
    if (per_chunk > 0 && ++in_chunk == per_chunk) flush();
  }
  flush();
  file += record('\x0f', le(std::uint32_t{0}));
  if (summary) file += descriptions;
  file += record('\x02', le(std::uint64_t{0}) + le(std::uint64_t{0}) + le(std::uint32_t{0}));
  return file + magic;
}

/// A temporary folder for the files of a test.
class TestFolder {
 public:
  TestFolder() {
    static int counter = 0;
    folder_ = test::own_path(fmt::format("recording_{}", counter++));
    std::filesystem::create_directories(folder_);
  }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;
  ~TestFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }
  /// Writes an SQLite file of rosbag2.
  std::filesystem::path write_sqlite(const std::string& name,
                                     const std::vector<TestMessage>& messages) const {
    sqlite3* database = nullptr;
    sqlite3_open(path(name).c_str(), &database);
    const auto run = [&](const std::string& query) {
      if (sqlite3_exec(database, query.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
        throw std::runtime_error(sqlite3_errmsg(database));
    };
    run("BEGIN; CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT "
        "NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL); CREATE TABLE "
        "messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
        "data BLOB NOT NULL)");
    std::map<std::string, int> topics;
    for (const auto& [topic, type, data, stamp] : messages) {
      const auto [found, added] = topics.emplace(topic, static_cast<int>(topics.size()) + 1);
      if (added)
        run(fmt::format("INSERT INTO topics VALUES({}, '{}', '{}', 'cdr', '')", found->second,
                        topic, type));
      sqlite3_stmt* insert = nullptr;
      sqlite3_prepare_v2(database, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?,?,?)",
                         -1, &insert, nullptr);
      sqlite3_bind_int(insert, 1, found->second);
      sqlite3_bind_int64(insert, 2, stamp);
      sqlite3_bind_blob(insert, 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
      sqlite3_step(insert);
      sqlite3_finalize(insert);
    }
    run("COMMIT");
    sqlite3_close(database);
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

/// Settings of a camera in its camera_info.
struct TestSettings {
  bool without_k = false;                             // K is 0
  std::uint32_t binning = 0;                          // in both directions
  std::uint32_t x = 0, y = 0, width = 0, height = 0;  // region of interest
};

/// Messages as cameras send them.
struct TestCamera {
  Kind kind = Kind::kLittleCdr;
  std::string frame = "color_optical";

  std::string image(std::uint32_t seconds, std::uint32_t ns, int width, int height,
                    const std::string& encoding, int pixel_bytes, const std::string& pixels) const {
    MessageWriter writer(kind);
    writer.header(seconds, ns, frame);
    writer.put(static_cast<std::uint32_t>(height))
        .put(static_cast<std::uint32_t>(width))
        .text(encoding);
    writer.put(static_cast<std::uint8_t>(kind == Kind::kBigCdr))
        .put(static_cast<std::uint32_t>(width * pixel_bytes));
    return writer.data(pixels).bytes();
  }
  std::string compressed_image(std::uint32_t seconds, std::uint32_t ns, const std::string& format,
                               const std::string& data) const {
    return MessageWriter(kind).header(seconds, ns, frame).text(format).data(data).bytes();
  }
  /// @param shift  P[3], the negative product of P[0] (2 f) and the position in a stereo pair
  std::string info(int width, int height, double f, const std::string& model,
                   const std::vector<double>& distortion, double shift = 0,
                   const TestSettings& settings = {}) const {
    MessageWriter writer(kind);
    writer.header(1, 0, frame)
        .put(static_cast<std::uint32_t>(height))
        .put(static_cast<std::uint32_t>(width))
        .text(model);
    writer.put(static_cast<std::uint32_t>(distortion.size()));
    for (const double value : distortion) writer.put(value);
    const double cx = (width - 1) / 2.0, cy = (height - 1) / 2.0;
    for (const double value : {f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0})
      writer.put(settings.without_k ? 0.0 : value);
    for (const double value : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) writer.put(value);
    for (const double value : {2 * f, 0.0, cx, shift, 0.0, 2 * f, cy, 0.0, 0.0, 0.0, 1.0, 0.0})
      writer.put(value);
    for (const std::uint32_t value : {settings.binning, settings.binning, settings.x, settings.y,
                                      settings.height, settings.width})
      writer.put(value);
    return writer.put(std::uint8_t{0}).bytes();
  }
  std::string imu(std::int64_t stamp, const std::vector<double>& angular_velocity,
                  const std::vector<double>& acceleration) const {
    MessageWriter writer(kind);
    writer.header(static_cast<std::uint32_t>(stamp / 1'000'000'000),
                  static_cast<std::uint32_t>(stamp % 1'000'000'000), frame);
    const auto put = [&](const std::vector<double>& numbers) {
      for (const double number : numbers) writer.put(number);
    };
    put({0, 0, 0, 1});
    put(std::vector<double>(9, 0));
    put(angular_velocity);
    put(std::vector<double>(9, 0));
    put(acceleration);
    put(std::vector<double>(9, 0));
    return writer.bytes();
  }
  /// @param numbers  position and quaternion x y z w
  std::string odometry(std::int64_t stamp, const std::string& child,
                       const std::vector<double>& numbers) const {
    MessageWriter writer(kind);
    writer
        .header(static_cast<std::uint32_t>(stamp / 1'000'000'000),
                static_cast<std::uint32_t>(stamp % 1'000'000'000), "odom")
        .text(child);
    for (const double number : numbers) writer.put(number);
    for (int i = 0; i < 36 + 6 + 36; ++i) writer.put(0.0);  // covariances and velocities
    return writer.bytes();
  }
  std::string transform(const std::string& parent, const std::string& child,
                        const std::vector<double>& numbers) const {
    MessageWriter writer(kind);
    writer.put(std::uint32_t{1}).header(0, 0, parent).text(child);
    for (const double value : numbers) writer.put(value);
    return writer.bytes();
  }
};

}  // namespace stillmap::test
