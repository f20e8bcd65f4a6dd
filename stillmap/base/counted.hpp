// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace stillmap {

/// Returns a number with its noun, whose plural is regular: "1 frame", "2 frames", "3 passes".
template <typename Number>
std::string counted(Number count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun,
                     count == Number{1}    ? ""
                     : noun.ends_with('s') ? "es"
                                           : "s");
}

/// Returns the verb for a number of subjects: "1 frame has", "2 frames have".
template <typename Number>
std::string_view have(Number count) {
  return count == Number{1} ? "has" : "have";
}

}  // namespace stillmap
