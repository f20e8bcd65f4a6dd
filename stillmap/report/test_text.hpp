// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap::test {

/// Returns how often a part occurs in a text.
inline int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace stillmap::test
