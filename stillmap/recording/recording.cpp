// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/recording.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

// rosbag2 numbers the files of a recording: name_0.db3, name_1.db3, ..., name_10.db3.
bool in_order_of_recording(const fs::path& a, const fs::path& b) {
  const auto key = [](const fs::path& file) {
    const std::string stem = file.stem().string();
    const auto digits = stem.find_last_not_of("0123456789") + 1;
    return std::pair(stem.size() - digits, stem);
  };
  return key(a) < key(b);
}

std::vector<fs::path> recording_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const auto extension = entry.path().extension();
    if (entry.is_regular_file(ignored) && (extension == ".db3" || extension == ".mcap"))
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end(), in_order_of_recording);
  return files;
}

}  // namespace

Recording::Recording(const fs::path& path) : path_(path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    add(path);
    return;
  }
  for (const fs::path& file : recording_files(path)) add(file);
  if (files_.empty())
    throw Error("contains no .db3 or .mcap file", path.string(), "give a folder of `ros2 bag`");
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
  const std::string text =
      fmt::format("{}{}.{:09}", negative ? "-" : "", magnitude / kSecond, magnitude % kSecond);
  return std::strtod(text.c_str(), nullptr);
}

}  // namespace stillmap
