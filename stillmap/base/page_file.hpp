// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace stillmap {

/// Read-only bytes in a PageFile. The operating system reads a page of them into memory when it is
/// used. They may be used by any thread, and outlive their PageFile; their space on the disk is
/// freed with them.
class Pages {
 public:
  ~Pages();
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;

  const std::byte* data() const { return data_; }
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
  explicit PageFile(const std::filesystem::path& folder);

  /// Writes bytes, which must not be empty, one part after the other. Throws Error if they cannot
  /// be written (disk full); the file can be used nevertheless.
  std::shared_ptr<const Pages> store(std::span<const std::string_view> parts);

 private:
  std::filesystem::path folder_;
  std::shared_ptr<const Pages::File> file_;
  std::size_t end_ = 0;  // position of the next bytes
};

}  // namespace stillmap
