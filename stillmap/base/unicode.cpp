// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/unicode.hpp"

#include <algorithm>
#include <cstddef>

namespace stillmap {
namespace {

/// Appends a code point as UTF-8 (RFC 3629).
void append(std::string& text, char32_t code) {
  const auto put = [&](char32_t byte) { text += static_cast<char>(byte); };
  const auto put_rest = [&](int shift) { put(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xc0 | code >> 6);
    put_rest(0);
  } else if (code < 0x10000) {
    put(0xe0 | code >> 12);
    put_rest(6);
    put_rest(0);
  } else {
    put(0xf0 | code >> 18);
    for (const int shift : {12, 6, 0}) put_rest(shift);
  }
}

/// Converts UTF-16 (RFC 2781); an unpaired surrogate becomes the replacement character.
std::string from_utf16(std::string_view text, bool big_endian) {
  constexpr char32_t kReplacement = 0xfffd, kBeyondPlane = 0x10000;
  const auto unit = [&](std::size_t i) {
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
    return static_cast<char32_t>(big_endian ? byte(i) << 8 | byte(i + 1)
                                            : byte(i + 1) << 8 | byte(i));
  };
  const auto is_high = [](char32_t code) { return code >= 0xd800 && code < 0xdc00; };
  const auto is_low = [](char32_t code) { return code >= 0xdc00 && code < 0xe000; };
  std::string converted;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    const char32_t code = unit(i);
    if (!is_high(code)) {
      append(converted, is_low(code) ? kReplacement : code);
    } else if (i + 3 < text.size() && is_low(unit(i + 2))) {
      append(converted, kBeyondPlane + ((code - 0xd800) << 10) + (unit(i + 2) - 0xdc00));
      i += 2;
    } else {
      append(converted, kReplacement);
    }
  }
  return converted;
}

}  // namespace

std::string as_utf8(std::string_view text) {
  std::string result;
  if (text.starts_with("\xFF\xFE")) {
    result = from_utf16(text.substr(2), /*big_endian=*/false);
  } else if (text.starts_with("\xFE\xFF")) {
    result = from_utf16(text.substr(2), /*big_endian=*/true);
  } else {
    result = text.substr(text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  }
  if (result.find('\n') == std::string::npos)
    std::replace(result.begin(), result.end(), '\r', '\n');
  return result;
}

}  // namespace stillmap
