// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/contents_cache.hpp"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

// Largest number of files whose contents are kept: more than a recording in parts usually has.
constexpr std::size_t kLargestCache = 64;

struct ContentsCache {
  std::mutex mutex;
  std::vector<std::pair<FileVersion, std::shared_ptr<const RecordingContents>>> files;  // by age
};

ContentsCache& cache() {
  static ContentsCache instance;
  return instance;
}

}  // namespace

std::optional<FileVersion> version_of(const fs::path& file) {
  // File systems store times in steps, so that a file can change twice within one.
  constexpr std::chrono::seconds kSettled(2);
  std::error_code failed, ignored;
  FileVersion version;
  version.file = fs::canonical(file, failed);
  if (!failed) version.size = fs::file_size(file, failed);
  if (!failed) version.changed = fs::last_write_time(file, failed);
  const bool has_log = fs::exists(file.string() + "-wal", ignored);
  const bool settled = !failed && fs::file_time_type::clock::now() - version.changed > kSettled;
  return settled && !has_log ? std::optional(version) : std::nullopt;
}

std::shared_ptr<const RecordingContents> known_contents(const FileVersion& version) {
  ContentsCache& known = cache();
  const std::scoped_lock lock(known.mutex);
  const auto found = std::find_if(known.files.begin(), known.files.end(),
                                  [&](const auto& entry) { return entry.first == version; });
  return found == known.files.end() ? nullptr : found->second;
}

void keep_contents(const FileVersion& version, const RecordingContents& contents) {
  auto kept = std::make_shared<const RecordingContents>(contents);
  ContentsCache& known = cache();
  const std::scoped_lock lock(known.mutex);
  std::erase_if(known.files, [&](const auto& entry) { return entry.first.file == version.file; });
  if (known.files.size() == kLargestCache) known.files.erase(known.files.begin());
  known.files.emplace_back(version, std::move(kept));
}

}  // namespace stillmap
