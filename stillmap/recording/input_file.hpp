// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/byte_cursor.hpp"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace stillmap {

/// A regular file that is open for reading at any position.
class InputFile {
 public:
  /// Throws Error if the file is missing, is not a regular file, or cannot be read.
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }  ///< Size when the file was opened [bytes].
  /// Fills the buffer with the bytes at `offset`; returns fewer bytes at the end of the file.
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> buffer) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// A part of a file, or bytes in memory, that is read from start to end in small pieces.
class ByteSource {
 public:
  /// Reads bytes [begin, end) of a file with a buffer.
  ByteSource(const InputFile& file, std::uint64_t begin, std::uint64_t end)
      : file_(&file), end_(std::min(end, file.size())), buffer_begin_(begin) {}
  /// Reads from memory, which must outlive the source.
  explicit ByteSource(ByteSpan bytes) : memory_(bytes), end_(bytes.size()) {}

  std::uint64_t end() const { return end_; }  ///< Position behind the last byte.
  /// Returns the bytes at a position: `count` bytes, or fewer at the end. They are valid until the
  /// next call.
  ByteSpan at(std::uint64_t position, std::size_t count);

 private:
  const InputFile* file_ = nullptr;
  ByteSpan memory_;
  std::uint64_t end_;
  std::vector<std::uint8_t> buffer_;
  std::uint64_t buffer_begin_ = 0;
};

}  // namespace stillmap
