// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace stillmap {

/// A temporary file with the content of a file that was compressed by zstd as a whole. It is
/// removed with this object; a reader that has opened it can still read it.
class DecompressedFile {
 public:
  /// A damaged or truncated file is decompressed as far as it goes.
  /// @param compressed  one or several zstd frames
  /// Throws Error if it cannot be read, if there is not enough space, or if it decompresses to more
  /// than a thousand times its size.
  explicit DecompressedFile(const std::filesystem::path& compressed);
  ~DecompressedFile();
  DecompressedFile(const DecompressedFile&) = delete;
  DecompressedFile& operator=(const DecompressedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace stillmap
