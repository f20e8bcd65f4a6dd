// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cctype>
#include <string>

namespace stillmap {

/// Returns a part of a file in a form suitable for messages: at most 40 bytes, control characters
/// and all bytes that are not ASCII replaced by question marks.
inline std::string printable(std::string text) {
  constexpr std::size_t kLongest = 40;
  if (text.size() > kLongest) {
    text.resize(kLongest - 3);
    text += "...";
  }
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c > 0x7e || std::iscntrl(c) != 0; },
      '?');
  return text;
}

}  // namespace stillmap
