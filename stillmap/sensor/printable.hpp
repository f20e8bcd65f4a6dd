// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cctype>
#include <string>

namespace stillmap {

/// A piece of a file as it can stand in a message: at most 40 bytes, control characters as question
/// marks.
inline std::string printable(std::string text) {
  constexpr std::size_t kLongest = 40;
  if (text.size() > kLongest) {
    text.resize(kLongest - 3);
    text += "...";
  }
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, '?');
  return text;
}

}  // namespace stillmap
