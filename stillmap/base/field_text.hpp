// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cctype>
#include <string>

namespace stillmap {

/// Returns a name from an untrusted file with blanks in place of control characters and commas,
/// which separate lines and columns of the files of results.
inline std::string field_text(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c == ',' || std::iscntrl(c) != 0; },
      ' ');
  return name;
}

}  // namespace stillmap
