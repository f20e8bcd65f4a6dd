// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <optional>
#include <type_traits>

namespace stillmap {

/// Returns the result of reading a message; none if the message is damaged, so that others can be
/// tried.
template <typename Read>
std::optional<std::invoke_result_t<Read>> if_readable(const Read& read) {
  try {
    return read();
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace stillmap
