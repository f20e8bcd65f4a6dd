// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

namespace stillmap {

using ByteSpan = std::span<const std::uint8_t>;

/// Reads little-endian numbers and byte strings from memory that may be damaged: reading beyond the
/// end throws Error.
class ByteCursor {
 public:
  /// @param bytes  must outlive the cursor and the returned spans
  explicit ByteCursor(ByteSpan bytes) : bytes_(bytes) {}

  template <typename T>
  T get() {
    static_assert(std::is_arithmetic_v<T>);
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  ByteSpan take(std::uint64_t count) {
    if (count > left()) {
      throw Error(fmt::format("{} bytes are declared, but only {} are left", count, left()), "",
                  "");
    }
    const ByteSpan taken = bytes_.subspan(position_, count);
    position_ += count;
    return taken;
  }
  /// Returns the text behind its 32-bit length.
  std::string_view text() { return as_text(take(get<std::uint32_t>())); }

  std::size_t position() const { return position_; }              ///< [bytes]
  std::size_t left() const { return bytes_.size() - position_; }  ///< [bytes]

  static std::string_view as_text(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

 private:
  ByteSpan bytes_;
  std::size_t position_ = 0;
};

}  // namespace stillmap
