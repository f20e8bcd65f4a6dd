// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace stillmap {

static_assert(std::endian::native == std::endian::little, "numbers are copied without conversion");

/// Writes numbers and texts into the bytes of a binary file, little-endian.
class ByteWriter {
 public:
  template <typename T>
  void put(const T& value) {
    put_list(std::span(&value, 1));
  }
  /// Writes values as in memory; `T` must have no padding.
  template <typename T>
  void put_list(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  /// Writes the first bytes of all values, then all second bytes, and so on: numbers with similar
  /// upper bytes compress better this way.
  template <typename T>
  void put_planes(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* in = reinterpret_cast<const char*>(values.data());
    const std::size_t begin = bytes_.size();
    bytes_.resize(begin + values.size_bytes());
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (std::size_t plane = 0; plane < sizeof(T); ++plane) {
        bytes_[begin + plane * values.size() + i] = in[i * sizeof(T) + plane];
      }
    }
  }
  /// Writes the length and the text.
  void put_text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    bytes_.append(text);
  }

  const std::string& bytes() const { return bytes_; }
  /// Reserves this number of bytes in total.
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  /// Returns the bytes and leaves the writer empty.
  std::string take() { return std::exchange(bytes_, {}); }

 private:
  std::string bytes_;
};

/// Reads the bytes of a ByteWriter. Reading beyond the end throws Error, and so does fail().
///
class ByteReader {
 public:
  /// @param bytes  must outlive the reader
  /// @param where  file and section for error messages
  /// @param fix    advice for a damaged file
  ByteReader(std::string_view bytes, std::string where, std::string fix)
      : bytes_(bytes), where_(std::move(where)), fix_(std::move(fix)) {}

  template <typename T>
  T get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    std::memcpy(&value, claim(1, sizeof(T)), sizeof(T));
    return value;
  }
  template <typename T>
  std::vector<T> get_list(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const char* in = claim(count, sizeof(T));
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), in, count * sizeof(T));
    return values;
  }
  template <typename T>
  std::vector<T> get_planes(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const char* in = claim(count, sizeof(T));
    std::vector<T> values(count);
    auto* out = reinterpret_cast<char*>(values.data());
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t plane = 0; plane < sizeof(T); ++plane) {
        out[i * sizeof(T) + plane] = in[plane * count + i];
      }
    }
    return values;
  }
  std::string get_text() {
    const auto size = get<std::uint32_t>();
    return {claim(size, 1), size};
  }

  std::size_t left() const { return bytes_.size() - at_; }  ///< Number of unread bytes.
  /// Nothing may be left.
  void expect_end() const {
    if (left() != 0) fail(fmt::format("{} bytes too many", left()));
  }
  /// Throws Error with a problem of the bytes read last.
  [[noreturn]] void fail(const std::string& problem) const {
    throw Error(problem, fmt::format("{}, byte {}", where_, at_), fix_);
  }

 private:
  const char* claim(std::size_t count, std::size_t size) {
    if (count > left() / size) {
      fail(
          fmt::format("{} times {} bytes are declared, but only {} are left", count, size, left()));
    }
    const char* begin = bytes_.data() + at_;
    at_ += count * size;
    return begin;
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::string where_, fix_;
};

}  // namespace stillmap
