// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/byte_cursor.hpp"

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace stillmap {

/// Compression of a chunk. LZ4 and Zstandard data are complete frames with magic numbers.
enum class Compression { kNone, kBzip2, kLz4, kZstd };

/// Returns the compression that a chunk of a ROS 1 bag or an MCAP file names ("", "none", "bz2",
/// "lz4", "zstd"); none for an unknown name.
std::optional<Compression> compression_of(std::string_view name);

/// Decompressed bytes.
struct Decompressed {
  std::vector<std::uint8_t> bytes;
  /// Whether the data ended as declared; otherwise the bytes before the damage or the end.
  bool complete = false;
};

/// Maximum size of decompressed data [bytes]. Recorders write chunks of about one megabyte or one
/// message.
inline constexpr std::uint64_t kLargestChunk = 512 << 20;

/// Decompresses data whose decompressed size is known. Memory grows with the decompressed bytes,
/// not with the declared size. Throws Error if more than kLargestChunk bytes are declared.
/// @param declared  decompressed size [bytes]
Decompressed decompress(Compression compression, ByteSpan data, std::uint64_t declared);

}  // namespace stillmap
