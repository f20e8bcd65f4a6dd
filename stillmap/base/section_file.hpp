// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <istream>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A file format of compressed, checksummed sections.
struct SectionFormat {
  std::string_view magic;     ///< First eight bytes of the file.
  std::uint32_t version = 1;  ///< Version of the layout; newer versions are not read.
  std::string_view name;      ///< Name for messages, such as "saved map".
  std::string_view remake;    ///< Advice for messages: how to create the file again.
  std::uint32_t oldest = 0;   ///< Oldest version that is read; 0: only `version`.
};

/// A named section of a file.
struct Section {
  std::array<char, 4> name = {};
  std::string bytes;
  bool operator==(const Section&) const = default;
};

/// Writes sections into a file, one after the other, so that only one is in memory. All numbers are
/// little-endian:
///
///     offset      size  content
///     0           8     magic of the format
///     8           4     version
///     12          4     number of sections S, at most 65536
///     16          8     size of the whole file
///     24          24 S  per section: name (4 characters), CRC-32 of its compressed bytes (4),
///                       number of compressed bytes (8), number of uncompressed bytes (8)
///     24 + 24 S   4     CRC-32 of all bytes before this
///     28 + 24 S   ...   sections, compressed with raw DEFLATE (RFC 1951), in sequence
///
/// A section has at most 64 KiB and 16 times its compressed bytes, so that a small file cannot take
/// much memory; sections that could be compressed further are stored without compression.
/// The same sections give the same bytes.
class SectionWriter {
 public:
  /// @param out   a stream at its beginning that can be moved in; its state tells of failures
  /// @param count number of sections that will be added
  SectionWriter(const SectionFormat& format, std::ostream& out, std::size_t count);
  void add(const Section& section) { add(std::span(&section, 1)); }
  /// Adds several, which are compressed at the same time.
  void add(std::span<const Section> sections);
  /// Writes the header. Called after the last add().
  void finish();

 private:
  /// Entry of the table.
  struct Entry {
    std::array<char, 4> name = {};
    std::uint32_t checksum = 0;
    std::uint64_t packed = 0, plain = 0;
  };
  friend class SectionReader;

  const SectionFormat format_;
  std::ostream& out_;
  const std::size_t count_;
  std::vector<Entry> table_;
};

/// Reads the sections of such a file, one after the other.
class SectionReader {
 public:
  /// Reads the header. Throws Error with the reason if the file is of another kind or version,
  /// truncated or extended, or if its header is altered.
  /// @param in    a stream that can be moved in; must outlive the reader
  /// @param where file name for messages
  SectionReader(const SectionFormat& format, std::istream& in, std::string where);

  std::uint32_t version() const { return version_; }
  /// Returns the next section; none after the last one. Throws Error if it is altered.
  std::optional<Section> next();

 private:
  [[noreturn]] void fail(const std::string& problem) const;
  [[noreturn]] void fail_short(std::uint64_t wanted) const;
  std::string read(std::uint64_t size);
  void check_kind(std::string_view preamble) const;
  void read_table(std::string_view preamble);

  const SectionFormat format_;
  std::istream& in_;
  const std::string where_;
  std::uint64_t size_ = 0;  // of the file [bytes]
  std::uint64_t at_ = 0;    // position of the next section
  std::uint32_t version_ = 0;
  std::vector<SectionWriter::Entry> table_;
  std::size_t read_ = 0;  // number of sections read
};

/// Returns the sections as the bytes of a file.
std::string pack_sections(const SectionFormat& format, const std::vector<Section>& sections);
/// Returns all sections in the bytes of a file. Throws Error as SectionReader.
std::vector<Section> unpack_sections(const SectionFormat& format, std::string_view bytes,
                                     const std::string& where);

}  // namespace stillmap
