// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/view/cloud_chunks.hpp"

#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace stillmap {

static_assert(std::endian::native == std::endian::little, "messages are little endian");

/// A binary message while it is made: little endian; its type and three zero bytes come first.
class MessageBytes {
 public:
  explicit MessageBytes(BinaryMessage type) : bytes_{static_cast<char>(type), 0, 0, 0} {}

  void reserve(std::size_t size) { bytes_.reserve(size); }

  template <typename T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  void add_bytes(std::string_view bytes) { bytes_ += bytes; }

  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace stillmap
