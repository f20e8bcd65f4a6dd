// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A kind of file made of compressed, checksummed sections.
struct SectionFormat {
  std::string_view magic;     ///< the file's first eight bytes
  std::uint32_t version = 1;  ///< of the layout, which is the only one that is read
  std::string_view name;      ///< for messages: "saved map"
  std::string_view remake;    ///< for messages: how to make one anew
};

/// A named part of a file.
struct Section {
  std::array<char, 4> name = {};
  std::string bytes;
  bool operator==(const Section&) const = default;
};

/// The sections as the bytes of a file, all numbers little-endian:
///
///     offset      size  what
///     0           8     the format's magic
///     8           4     its version
///     12          4     number of sections S, at most 64
///     16          8     bytes of the whole file
///     24          24 S  per section: name (4 characters), CRC-32 of its packed bytes (4),
///                       number of packed bytes (8), number of plain bytes (8)
///     24 + 24 S   4     CRC-32 of all bytes before this
///     28 + 24 S   ...   the sections, packed as raw DEFLATE (RFC 1951), one behind the other
///
/// The same sections give the same bytes. Each is freed as soon as it is packed.
std::string pack_sections(const SectionFormat& format, std::vector<Section> sections);

/// The sections of such a file. Throws Error, naming what is wrong, if the bytes are of another
/// kind or version, cut short, added to, or altered in any place.
/// @param where  the file's name, for messages
std::vector<Section> unpack_sections(const SectionFormat& format, std::string_view bytes,
                                     const std::string& where);

}  // namespace stillmap
