// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace stillmap {

/// Returns the largest size that compressed bytes may declare [bytes]. DEFLATE compresses up to
/// 1032 times, so a file of 6 MB could take 6 GB of memory; maps are compressed 2.2 times at most
/// (measured).
constexpr std::uint64_t largest_inflated(std::uint64_t packed) { return (64U << 10) + 16 * packed; }

/// Returns the CRC-32 of the bytes.
/// @param before  CRC-32 of the bytes before them
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

/// Returns the bytes compressed with raw DEFLATE (RFC 1951); stored without compression if they
/// are more than largest_inflated() of their compressed bytes.
/// @param level  effort, 1 (fast) to 12
std::string deflated(std::string_view plain, int level);

/// Returns the bytes as a zlib stream (RFC 1950), as PNG files contain.
std::string zlib_stream(std::string_view plain, int level);

/// Returns the uncompressed bytes; none if they are not `size` bytes, more than largest_inflated(),
/// or if the input is damaged.
std::optional<std::string> inflated(std::string_view packed, std::uint64_t size);

}  // namespace stillmap
