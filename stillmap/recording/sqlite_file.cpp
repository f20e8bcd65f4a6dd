// SPDX-License-Identifier: Apache-2.0
// SQLite files of rosbag2: tables topics(id, name, type, serialization_format) and messages(id,
// topic_id, timestamp [ns], data).
#include "stillmap/base/error.hpp"
#include "stillmap/recording/recording_file.hpp"

#include <array>
#include <memory>
#include <sqlite3.h>
#include <unordered_map>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
struct CloseBlob {
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;
using Blob = std::unique_ptr<sqlite3_blob, CloseBlob>;

constexpr const char* kFix = "give a file that `ros2 bag record` or RealSense's recorder wrote";

// A file is opened as immutable, so that no other file is written to its folder, unless a
// write-ahead log holds a part of its messages.
std::string uri_of(const fs::path& path) {
  std::string uri = "file:";
  for (const char c : fs::absolute(path).string()) {
    const bool reserved = c == '%' || c == '?' || c == '#';
    uri += reserved ? fmt::format("%{:02X}", c) : std::string(1, c);
  }
  std::error_code ignored;
  const auto log_size = fs::file_size(path.string() + "-wal", ignored);
  const bool has_log = !ignored && log_size > 0;
  return uri + (has_log ? "?mode=ro" : "?mode=ro&immutable=1");
}

std::string text_at(sqlite3_stmt* statement, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
  return text == nullptr ? "" : text;
}

class SqliteFile : public RecordingFile {
 public:
  SqliteFile(const fs::path& path, const RecordingContents* known) : path_(path) {
    sqlite3* opened = nullptr;
    const int flags = SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX;
    const int state = sqlite3_open_v2(uri_of(path).c_str(), &opened, flags, nullptr);
    database_.reset(opened);
    if (state != SQLITE_OK) throw failure("cannot be opened");
    sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(kLargestChunk));
    // writable_schema makes SQLite accept a file that is shorter than its header says.
    sqlite3_exec(opened,
                 "PRAGMA writable_schema=ON; PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON;",
                 nullptr, nullptr, nullptr);
    require_tables();
    if (known != nullptr) {
      set_contents(*known);
      return;
    }
    scan_topics();
    scan_messages();
    set_index(builder_.take());
  }

 private:
  Error failure(const std::string& what) const {
    return Error(fmt::format("{} ({})", what, sqlite3_errmsg(database_.get())), path_.string(),
                 kFix);
  }
  Statement prepare(const char* query) const {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query, -1, &statement, nullptr) != SQLITE_OK)
      throw failure("is no recording of rosbag2");
    return Statement(statement);
  }
  // Views and virtual tables could compute without an end.
  void require_tables() const {
    const Statement query = prepare(
        "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', "
        "'messages') AND rootpage > 0");
    if (sqlite3_step(query.get()) != SQLITE_ROW) throw failure("cannot be read");
    if (sqlite3_column_int(query.get(), 0) != 2)
      throw Error("has no tables 'topics' and 'messages'", path_.string(), kFix);
  }
  void scan_topics() {
    const Statement query = prepare("SELECT id, name, type, serialization_format FROM topics");
    int state = sqlite3_step(query.get());
    for (; state == SQLITE_ROW; state = sqlite3_step(query.get())) {
      topics_.emplace(sqlite3_column_int64(query.get(), 0),
                      builder_.add_topic(text_at(query.get(), 1), text_at(query.get(), 2),
                                         text_at(query.get(), 3)));
    }
    if (state != SQLITE_DONE) throw failure("its list of topics is damaged");
  }
  void scan_messages() {
    const Statement query =
        prepare("SELECT rowid, topic_id, timestamp, length(data) FROM messages ORDER BY rowid");
    std::uint64_t count = 0;
    int state = sqlite3_step(query.get());
    for (; state == SQLITE_ROW; state = sqlite3_step(query.get()), ++count) {
      const auto topic = topics_.find(sqlite3_column_int64(query.get(), 1));
      if (topic == topics_.end()) {
        builder_.add_problem("a message belongs to no topic");
        continue;
      }
      add_message({.log_time = sqlite3_column_int64(query.get(), 2),
                   .topic = topic->second,
                   .offset = static_cast<std::uint64_t>(sqlite3_column_int64(query.get(), 0)),
                   .size = static_cast<std::uint64_t>(sqlite3_column_int64(query.get(), 3))});
    }
    if (state != SQLITE_DONE) {
      builder_.add_problem(fmt::format("the file is truncated or damaged behind message {} ({})",
                                       count, sqlite3_errmsg(database_.get())));
    }
    blob_.reset();
  }
  void add_message(const MessageEntry& entry) {
    if (!builder_.lists(entry.topic)) return builder_.add_message(entry, {});
    std::array<std::uint8_t, 12> start{};
    const auto wanted = std::min<std::uint64_t>(start.size(), entry.size);
    if (!read_blob(entry, std::span(start).first(wanted)))
      return builder_.add_problem("a message cannot be read");
    builder_.add_message(entry, ByteSpan(start).first(wanted));
  }

  // Fills the buffer with the first bytes of a message; returns false if it cannot be read.
  bool read_blob(const MessageEntry& entry, std::span<std::uint8_t> buffer) {
    const auto row = static_cast<sqlite3_int64>(entry.offset);
    if (!blob_ || sqlite3_blob_reopen(blob_.get(), row) != SQLITE_OK) {
      blob_.reset();
      sqlite3_blob* opened = nullptr;
      const int state =
          sqlite3_blob_open(database_.get(), "main", "messages", "data", row, 0, &opened);
      blob_.reset(opened);
      if (state != SQLITE_OK) return false;
    }
    const auto size = static_cast<std::uint64_t>(sqlite3_blob_bytes(blob_.get()));
    if (size != entry.size) return false;
    return sqlite3_blob_read(blob_.get(), buffer.data(), static_cast<int>(buffer.size()), 0) ==
           SQLITE_OK;
  }
  ByteSpan stored(const MessageEntry& entry) override {
    if (entry.size > kLargestChunk) throw Error("a message is too large", path_.string(), "");
    message_.resize(entry.size);
    if (!read_blob(entry, message_)) throw Error("a message cannot be read", path_.string(), "");
    return message_;
  }

  fs::path path_;
  Database database_;
  Blob blob_;
  IndexBuilder builder_;
  std::unordered_map<std::int64_t, std::uint32_t> topics_;  // by id in the file
  std::vector<std::uint8_t> message_;
};

}  // namespace

std::unique_ptr<RecordingFile> open_sqlite_file(const fs::path& path,
                                                const RecordingContents* known) {
  return std::make_unique<SqliteFile>(path, known);
}

}  // namespace stillmap
