// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace stillmap {

/// Memory for data, and the folder of the PageFile for what is beyond it.
struct MemoryLimit {
  std::uint64_t limit = 150000000;  ///< [bytes]
  /// Empty: that of the environment variable TMPDIR, or /var/tmp (which, unlike /tmp, is never in
  /// memory).
  std::filesystem::path folder;
};

/// Bytes in a PageFile. The operating system reads a page of them into memory when it is used. They
/// outlive their PageFile; their space on the disk is freed with them. Once they are written, they
/// may be used by any thread.
class Pages {
 public:
  ~Pages();
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;

  const std::byte* data() const { return data_; }
  std::byte* data() { return data_; }
  std::size_t size() const { return size_; }
  /// Gives back the memory of the pages that were used, until they are used again.
  void drop() const;

 private:
  friend class PageFile;
  class File;
  Pages(std::shared_ptr<const File> file, std::size_t begin, std::byte* data, std::size_t size)
      : file_(std::move(file)), begin_(begin), data_(data), size_(size) {}

  std::shared_ptr<const File> file_;
  std::size_t begin_;  // position in the file [bytes]
  std::byte* data_;
  std::size_t size_;
};

/// Temporary file for data that would take too much memory. It has no name, so that nothing is left
/// of it when the process ends, even if it is killed. One thread at a time.
class PageFile {
 public:
  /// Creates the file, and the folder if it is missing. Throws Error.
  /// @param folder  see MemoryLimit::folder
  explicit PageFile(const std::filesystem::path& folder);

  /// Writes bytes, which must not be empty, one part after the other. Throws Error if they cannot
  /// be written (disk full); the file can be used nevertheless.
  std::shared_ptr<const Pages> store(std::span<const std::string_view> parts);
  /// Returns bytes to be written by the caller, at least one. Throws Error if the disk has no room
  /// for them; the file can be used nevertheless.
  std::shared_ptr<Pages> reserve(std::size_t bytes);

 private:
  std::shared_ptr<Pages> next_pages(std::size_t size, bool writable);

  std::filesystem::path folder_;
  std::shared_ptr<const Pages::File> file_;
  std::size_t end_ = 0;  // position of the next bytes
};

/// A PageFile for what is beyond a limit of memory. It is created when it is needed, and given up
/// with a warning once it cannot be written (disk full): all further data stay in memory.
class SparePages {
 public:
  /// @param content  for the warning, such as "the dense map"
  SparePages(MemoryLimit memory, std::string content)
      : memory_(std::move(memory)), content_(std::move(content)) {}

  std::uint64_t limit() const { return memory_.limit; }
  /// Calls `write` with the file. Returns whether it was written.
  bool write(const std::function<void(PageFile&)>& write);

 private:
  MemoryLimit memory_;
  std::string content_;
  std::optional<PageFile> file_;
  bool failed_ = false;
};

}  // namespace stillmap
