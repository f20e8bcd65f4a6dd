// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace stillmap {

/// DEFLATE compresses at most 1032 times; a larger declared ratio is damage.
constexpr std::uint64_t kMaxDeflateRatio = 1040;

/// Returns the CRC-32 of the bytes.
std::uint32_t crc32(std::string_view bytes);

/// Returns the bytes compressed with raw DEFLATE (RFC 1951).
/// @param level  effort, 1 (fast) to 12
std::string deflated(std::string_view plain, int level);

/// Returns the uncompressed bytes; none if they are not `size` bytes or the input is damaged.
std::optional<std::string> inflated(std::string_view packed, std::uint64_t size);

}  // namespace stillmap
