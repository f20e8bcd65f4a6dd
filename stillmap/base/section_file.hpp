// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A file format of compressed, checksummed sections.
struct SectionFormat {
  std::string_view magic;     ///< First eight bytes of the file.
  std::uint32_t version = 1;  ///< Version of the layout; other versions are not read.
  std::string_view name;      ///< Name for messages, such as "saved map".
  std::string_view remake;    ///< Advice for messages: how to create the file again.
};

/// A named section of a file.
struct Section {
  std::array<char, 4> name = {};
  std::string bytes;
  bool operator==(const Section&) const = default;
};

/// Returns the sections as the bytes of a file, all numbers little-endian:
///
///     offset      size  content
///     0           8     magic of the format
///     8           4     version
///     12          4     number of sections S, at most 64
///     16          8     size of the whole file
///     24          24 S  per section: name (4 characters), CRC-32 of its compressed bytes (4),
///                       number of compressed bytes (8), number of uncompressed bytes (8)
///     24 + 24 S   4     CRC-32 of all bytes before this
///     28 + 24 S   ...   sections, compressed with raw DEFLATE (RFC 1951), in sequence
///
/// A section has at most 64 KiB and 16 times its compressed bytes, so that a small file cannot take
/// much memory; sections that could be compressed further are stored without compression.
/// The same sections give the same bytes. Each section is freed once it is compressed.
std::string pack_sections(const SectionFormat& format, std::vector<Section> sections);

/// Returns the sections of such a file. Throws Error with the reason if the bytes are of another
/// kind or version, truncated, extended, or altered anywhere.
/// @param where  file name for messages
std::vector<Section> unpack_sections(const SectionFormat& format, std::string_view bytes,
                                     const std::string& where);

}  // namespace stillmap
