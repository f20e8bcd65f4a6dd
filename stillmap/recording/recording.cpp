// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/recording.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/number.hpp"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

// Returns the name of a file before it was compressed as a whole: "a.db3" of "a.db3.zstd".
fs::path uncompressed(const fs::path& file) {
  const bool compressed = file.extension() == ".zstd" || file.extension() == ".zst";
  return compressed ? file.parent_path() / file.stem() : file;
}

// rosbag2 numbers the files of a recording: name_0.db3, name_1.db3, ..., name_10.db3.
bool in_order_of_recording(const fs::path& a, const fs::path& b) {
  const auto key = [](const fs::path& file) {
    const std::string stem = uncompressed(file).stem().string();
    const auto digits = stem.find_last_not_of("0123456789") + 1;
    return std::pair(stem.size() - digits, stem);
  };
  return key(a) < key(b);
}

std::vector<fs::path> recording_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path file = uncompressed(entry.path());
    const bool named = file.extension() == ".db3" || file.extension() == ".mcap";
    const bool twice = file != entry.path() && fs::exists(file, ignored);
    if (named && !twice && entry.is_regular_file(ignored)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end(), in_order_of_recording);
  return files;
}

// Returns the names of the files that rosbag2 lists in metadata.yaml: lines "- NAME" after the key
// relative_file_paths. Early versions also wrote the folder.
std::vector<std::string> listed_files(const fs::path& folder) {
  std::ifstream metadata(folder / "metadata.yaml");
  std::vector<std::string> names;
  bool inside = false;  // whether the line is in the list
  for (std::string line; std::getline(metadata, line);) {
    std::erase_if(line, [](char c) { return c == '"' || c == '\'' || c == '\r'; });
    line.erase(0, line.find_first_not_of(' '));
    const bool item = line.starts_with("- ");
    if (inside && !item) break;
    if (inside) names.push_back(fs::path(line.substr(2)).filename().string());
    inside = inside || line.starts_with("relative_file_paths:");
  }
  return names;
}

// Returns a sentence about files that metadata.yaml lists and the folder lacks; empty if none.
std::string missing_files(const fs::path& folder, const std::vector<fs::path>& present) {
  const std::vector<std::string> listed = listed_files(folder);
  std::vector<std::string> missing;
  for (const std::string& name : listed) {
    const bool found = std::any_of(present.begin(), present.end(), [&](const fs::path& file) {
      return uncompressed(file.filename()) == uncompressed(name);
    });
    if (!found) missing.push_back(name);
  }
  if (missing.empty()) return "";
  return fmt::format("the recording lacks {} of {}, so that it has gaps: metadata.yaml lists {}",
                     missing.size(), counted(listed.size(), "file"), fmt::join(missing, ", "));
}

}  // namespace

Recording::Recording(const fs::path& path) : path_(path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    add(path);
    return;
  }
  const std::vector<fs::path> files = recording_files(path);
  for (const fs::path& file : files) add(file);
  if (files_.empty())
    throw Error("contains no .db3 or .mcap file", path.string(), "give a folder of `ros2 bag`");
  if (std::string missing = missing_files(path, files); !missing.empty())
    warnings_.push_back(std::move(missing));
}

void Recording::add(const fs::path& file) {
  auto opened = open_recording_file(file);
  const RecordingIndex& index = opened->index();
  const auto file_index = static_cast<std::uint32_t>(files_.size());
  std::vector<std::uint32_t> merged;  // index here of each topic of the file
  for (const Topic& topic : index.topics) {
    const auto known = find_topic(topic.name);
    merged.push_back(known.value_or(static_cast<std::uint32_t>(topics_.size())));
    if (!known) {
      topics_.push_back(topic);
      continue;
    }
    Topic& sum = topics_[*known];
    if (topic.messages > 0) {
      sum.first_time =
          sum.messages > 0 ? std::min(sum.first_time, topic.first_time) : topic.first_time;
      sum.last_time = sum.messages > 0 ? std::max(sum.last_time, topic.last_time) : topic.last_time;
    }
    sum.messages += topic.messages;
  }
  std::vector<std::uint32_t> local(topics_.size());
  for (std::uint32_t i = 0; i < merged.size(); ++i) local[merged[i]] = i;
  for (MessageEntry entry : index.messages) {
    entry.topic = merged[entry.topic];
    entry.file = file_index;
    messages_.push_back(entry);
  }
  for (const std::string& warning : index.warnings)
    warnings_.push_back(file.filename().string() + ": " + warning);
  local_topics_.push_back(std::move(local));
  files_.push_back(std::move(opened));
}

std::vector<MessageEntry> Recording::messages_of(std::uint32_t topic) const {
  std::vector<MessageEntry> entries;
  std::copy_if(messages_.begin(), messages_.end(), std::back_inserter(entries),
               [&](const MessageEntry& entry) { return entry.topic == topic; });
  return entries;
}

std::optional<std::uint32_t> Recording::find_topic(const std::string& name) const {
  const auto found = std::find_if(topics_.begin(), topics_.end(),
                                  [&](const Topic& topic) { return topic.name == name; });
  if (found == topics_.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - topics_.begin());
}

double Recording::duration() const {
  bool any = false;
  std::int64_t first = 0, last = 0;
  for (const Topic& topic : topics_) {
    if (topic.messages == 0) continue;
    first = any ? std::min(first, topic.first_time) : topic.first_time;
    last = any ? std::max(last, topic.last_time) : topic.last_time;
    any = true;
  }
  return seconds_of(last - first);
}

ByteSpan Recording::read(const MessageEntry& entry) {
  MessageEntry local = entry;
  local.topic = local_topics_[entry.file][entry.topic];
  return files_[entry.file]->read(local);
}

bool is_recording(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return fs::is_regular_file(path, ignored);
  return !recording_files(path).empty();
}

double seconds_of(std::int64_t nanoseconds) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const bool negative = nanoseconds < 0;
  const auto magnitude = negative ? 0 - static_cast<std::uint64_t>(nanoseconds)
                                  : static_cast<std::uint64_t>(nanoseconds);
  return number_of(fmt::format("{}{}.{:09}", negative ? "-" : "", magnitude / kSecond,
                               magnitude % kSecond))
      .value();
}

}  // namespace stillmap
