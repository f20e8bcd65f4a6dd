// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace stillmap {

/// First eight bytes of a journal, and the version of its layout.
constexpr std::string_view kJournalMagic = "STILLJNL";
constexpr std::uint32_t kJournalVersion = 4;

/// Append-only file of records. A record is complete on return of append(), so a process that is
/// killed leaves a file with all its records; at most the last one is truncated.
///
///     size  content
///     8     magic
///     4     version
///     then, record by record:
///     8     number of compressed bytes
///     8     number of uncompressed bytes
///     4     CRC-32 of the two numbers and the compressed bytes
///     ...   the record, compressed with raw DEFLATE (RFC 1951)
class JournalWriter {
 public:
  /// Creates the file, or replaces it. Throws Error.
  explicit JournalWriter(std::filesystem::path file);
  /// Throws Error if the record cannot be written (disk full); later records are not readable then.
  void append(std::string_view record);
  /// Replaces all records by those that `write` appends, which must have the same meaning; the file
  /// is always whole.
  void replace_all(const std::function<void(JournalWriter&)>& write);

  std::uint64_t size() const { return size_; }  ///< Of the file [bytes].

 private:
  void write(std::string_view bytes);

  std::filesystem::path file_;
  std::ofstream out_;
  std::uint64_t size_ = 0;
};

/// Returns whether the file begins with the magic of a journal.
bool is_journal(const std::filesystem::path& file);

/// Reads the records of a journal, one after the other.
class JournalReader {
 public:
  /// Throws Error if the file cannot be read or is no journal of this version.
  explicit JournalReader(const std::filesystem::path& file);

  /// Returns the next record; none at the end, and from the first on that is truncated or altered.
  std::optional<std::string> next();
  /// Returns the number of bytes that are not read because a record before them is altered; 0 after
  /// a record that is only truncated, as of a killed process.
  std::uint64_t lost() const { return lost_; }

 private:
  /// Returns the next bytes; fewer at the end of the file.
  std::string read(std::uint64_t size);

  std::ifstream in_;
  std::uint64_t left_ = 0, lost_ = 0;  // [bytes]
};

}  // namespace stillmap
